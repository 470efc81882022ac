"""A controller for recordings in closed loop: swing up, balance, hang, follow a course, in turns.

Its commands answer measured samples, so delays, noise and errors of the sensors come back in the
input; a played plan does not have this feedback. The controller knows the nominal rig and nothing
of what is concealed. A first push shows which way a command moves the measured cart, and which way
the pole then swings.

The pole over a cart with acceleration a (ph from hanging; b = S/Jp, wn^2 = b g):
    ph'' = -b cos(ph) a - wn^2 sin(ph)
* Swing up: the energy w^2/2 - wn^2 cos(ph) grows at the rate -b w cos(ph) a, so a takes the sign
  of growth until the energy is wn^2. The true wn is uncertain, so the aim rises slowly, past every
  possible value, until the pole is caught.
* Balance: gains place the poles of the linearised cart and pole with input a: PLACED_POLYNOMIAL.
* Follow: a weak spring and damper pull towards a slow course, with the plan's tones on top.
In every mode a cart that would pass the free part of the rail returns to the middle first
(`Mode.RETURN`).

A relay controller follows the same modes and knows three commands alone: full left, none and full
right (a relay with a dead band; Tsypkin, Relay Control Systems (1984), chapter 1).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.plans import waveforms
from pendulum_twin.plans.waveforms import LEAD_S, PUSH_S, Envelope, make_envelope
from pendulum_twin.rig import Rig

PUSHED_S = LEAD_S + 2 * PUSH_S  # then the first push has moved the cart, and the pole opposite
BEGIN_S = 1.5  # of the first turn
FOLLOWED_S, TURN_S = 7.0, 20.0  # a turn begins with following; swing-up and balance come after
COURSE = ((0.15, 0.11), (0.1, 0.23))  # m, Hz
STIFFNESS, DAMPING = 1.0, 0.15  # command per m, per m/s: natural frequency 4 rad/s
PUMPING_M_S2 = 5.0  # moves the cart 0.15 m each way at the pole's own frequency
# Times the nominal energy: constants that are 20 % off change it by 50 %.
AIMS, AIMING_S = (0.8, 1.8), 10.0
SPRING_PER_S2, DRAG_PER_S = 5.0, 0.5  # of the cart meanwhile
PLACED_POLYNOMIAL = (16.0, 88.0, 192.0, 144.0)  # (s + 6)^2 (s + 2)^2, without its s^4
CATCH_RAD, CATCH_RAD_S, LOST_RAD = 0.35, 3.0, 0.7
CALM_S = 2.0  # of following after the pole was lost
# Shares of the rail's half length: from FREE on the cart returns, within BACK it has returned.
FREE, BACK = 0.5, 0.15
BRAKING_S = 0.15  # how far ahead the cart's position is predicted
RETURN_STIFFNESS, RETURN_DAMPING = 0.8, 0.3
# Of a relay: its command as a share of the limit, and the share of that from which it switches on.
RELAY_SIZE, RELAY_ON = 0.6, 0.25
DITHER = {"follow": 0.8, "swing": 0.0, "balance": 0.25}  # of the plan's tones


class Mode(Enum):
    """The modes of the controller."""

    PUSH = "push"
    FOLLOW = "follow"
    SWING = "swing"
    BALANCE = "balance"
    RETURN = "return"


@dataclass(frozen=True)
class Tuning:
    """Hold the constants of the controller.

    period_s: sample period.
    room: limits of command and rail of the nominal rig.
    coupling: b, 1/m.
    stiffness: wn^2, 1/s^2.
    damping: of the cart, 1/s.
    gains: of the acceleration, on pole angle from upright, pole rate, cart position and velocity.
    tones: (n,) the plan's commands, PWM fraction.
    relay: whether the controller knows three commands alone.
    """

    period_s: float
    room: Envelope
    coupling: float
    stiffness: float
    damping: float
    gains: tuple[float, float, float, float]
    tones: Floats
    relay: bool = False


@dataclass(frozen=True)
class Stand:
    """Hold the state of the controller.

    k: samples seen.
    mode: what it does.
    calm_until: sample until which it only follows.
    swinging_from: sample since which it swings up.
    first: position (m) and angle (rad) before the push.
    way: of the measured cart under a positive command, +1 or -1; 0 until the push has shown it.
    turn: -1 where the measured angle counts clockwise, else 1.
    """

    k: int = 0
    mode: Mode = Mode.PUSH
    calm_until: int = 0
    swinging_from: int = 0
    first: tuple[float, float] = (0.0, 0.0)
    way: int = 0
    turn: int = 1


def make_tuning(
    rig: Rig, seconds: float, period_s: float, seed: int, relay: bool = False
) -> Tuning:
    """Return the tuning for a nominal rig.

    seconds: length of the recording.
    seed: of the tones.
    relay: whether the controller knows three commands alone.
    Raises BadInputError for a rig without cart, drive or rail length.
    """
    room = make_envelope(rig)
    coupling = (
        rig.total_mass_kg * (rig.com_distance_m or 0.0) / (rig.pole_inertia_kg_m2 or math.inf)
    )
    times: Floats = np.arange(max(round(seconds / period_s), 2), dtype=np.float64) * period_s
    return Tuning(
        period_s,
        room,
        coupling,
        coupling * rig.gravity_m_s2,
        (rig.cart_viscous_n_s_m or 0.0) / rig.total_mass_kg,
        _place_poles(coupling, coupling * rig.gravity_m_s2),
        waveforms.make_tones(room, np.random.default_rng(seed))(times),
        relay,
    )


def _place_poles(coupling: float, stiffness: float) -> tuple[float, float, float, float]:
    """Return the gains k of a = -k (psi, w, x, v), with psi from upright.

    With them x'' = a, psi'' = b a + wn^2 psi has the poles of PLACED_POLYNOMIAL.
    """
    third, second, first, constant = PLACED_POLYNOMIAL
    on_x, on_v = -constant / stiffness, -first / stiffness
    return (second + stiffness - on_x) / coupling, (third - on_v) / coupling, on_x, on_v


def compute_control(stand: Stand, sample: Floats, tuning: Tuning) -> tuple[Stand, float]:
    """Return the next state of the controller and the command (PWM fraction) for a sample.

    sample: (4,) measured x (m), th (rad), v (m/s), w (rad/s).
    """
    x, th, v, w = (float(value) for value in sample)
    if stand.k == 0:
        stand = replace(stand, first=(x, th))
    if stand.way == 0:
        stand = _observe_push(stand, x, th, tuning)
    ph, w = stand.turn * (th - stand.first[1]), stand.turn * w
    before, stand = stand.mode, replace(stand, mode=_choose_mode(stand, x, v, ph, w, tuning))
    if stand.mode is Mode.SWING and before is not Mode.SWING:
        stand = replace(stand, swinging_from=stand.k)
    if stand.mode is Mode.RETURN and _has_lost_pole(ph):
        stand = replace(stand, calm_until=stand.k + round(CALM_S / tuning.period_s))
    limit = tuning.room.limit
    command = min(max(_compute_command(stand, (x, ph, v, w), tuning), -limit), limit)
    if tuning.relay and stand.mode is not Mode.PUSH:
        command = _switch(command, RELAY_SIZE * limit)
    return replace(stand, k=stand.k + 1), command


def _switch(command: float, size: float) -> float:
    """Return the relay's command for a command: size either way, or 0."""
    return 0.0 if abs(command) < RELAY_ON * size else math.copysign(size, command)


def _observe_push(stand: Stand, x: float, th: float, tuning: Tuning) -> Stand:
    """Return the state with the signs that the push has shown, when it is over."""
    if stand.k * tuning.period_s < PUSHED_S:
        return stand
    travel, swung = x - stand.first[0], th - stand.first[1]
    return replace(stand, way=-1 if travel < 0 else 1, turn=-1 if travel * swung > 0 else 1)


def _choose_mode(stand: Stand, x: float, v: float, ph: float, w: float, tuning: Tuning) -> Mode:
    t, half = stand.k * tuning.period_s, tuning.room.half_length_m
    if t < BEGIN_S and stand.mode is not Mode.RETURN:
        return Mode.PUSH
    if abs(x + BRAKING_S * v) > FREE * half:
        return Mode.RETURN
    if stand.mode is Mode.RETURN and abs(x) > BACK * half:
        return Mode.RETURN
    if (t - BEGIN_S) % TURN_S < FOLLOWED_S or stand.k < stand.calm_until:
        return Mode.FOLLOW
    leaning = abs(_measure_from_upright(ph))
    if stand.mode is Mode.BALANCE:
        return Mode.BALANCE if leaning < LOST_RAD else Mode.SWING
    return Mode.BALANCE if leaning < CATCH_RAD and abs(w) < CATCH_RAD_S else Mode.SWING


def _has_lost_pole(ph: float) -> bool:
    return abs(_measure_from_upright(ph)) > CATCH_RAD


def _measure_from_upright(ph: float) -> float:
    return math.remainder(ph - math.pi, math.tau)


def _compute_command(
    stand: Stand, state: tuple[float, float, float, float], tuning: Tuning
) -> float:
    x, ph, v, w = state
    t = stand.k * tuning.period_s
    if stand.mode is Mode.PUSH:
        return float(waveforms.make_push(tuning.room)(np.array([t]))[0])
    way = stand.way * tuning.room.unit
    if stand.mode is Mode.RETURN:
        return -way * (RETURN_STIFFNESS * x + RETURN_DAMPING * v)
    dither = DITHER[stand.mode.value] * float(tuning.tones[min(stand.k, len(tuning.tones) - 1)])
    if stand.mode is Mode.FOLLOW:
        course = sum(size * math.sin(math.tau * hz * (t - BEGIN_S)) for size, hz in COURSE)
        return dither - way * (STIFFNESS * (x - course) + DAMPING * v)
    since_s = (stand.k - stand.swinging_from) * tuning.period_s
    aim = AIMS[0] + (AIMS[1] - AIMS[0]) * math.fmod(since_s / AIMING_S, 1.0)
    wanted = (
        _swing_up(x, ph, v, w, aim, tuning)
        if stand.mode is Mode.SWING
        else _balance(x, ph, v, w, tuning)
    )
    return dither + stand.way * (wanted + tuning.damping * v) / tuning.room.acceleration_m_s2


def _swing_up(x: float, ph: float, v: float, w: float, aim: float, tuning: Tuning) -> float:
    """Return the acceleration (m/s^2) that swings the pole up and centres the cart.

    aim: wanted energy of the pole, in units of its energy upright.
    """
    lacking = aim * tuning.stiffness - (0.5 * w * w - tuning.stiffness * math.cos(ph))
    size = min(max(lacking / (0.2 * tuning.stiffness), -1.0), 1.0) * PUMPING_M_S2
    # small near the horizontal, where a push does nothing
    effectiveness = w * math.cos(ph) / math.sqrt(tuning.stiffness)
    return -size * math.tanh(2.0 * effectiveness) - SPRING_PER_S2 * x - DRAG_PER_S * v


def _balance(x: float, ph: float, v: float, w: float, tuning: Tuning) -> float:
    on_angle, on_rate, on_x, on_v = tuning.gains
    return -(on_angle * _measure_from_upright(ph) + on_rate * w + on_x * x + on_v * v)


class Controller:
    """Answer the samples of a recording in order: `compute_control` with its state kept."""

    def __init__(self, tuning: Tuning) -> None:
        self._tuning, self.stand = tuning, Stand()

    def __call__(self, sample: Floats) -> float:
        """Return the command (PWM fraction) that answers this sample."""
        self.stand, command = compute_control(self.stand, sample, self._tuning)
        return command

"""Make commands as functions of time, each as strong as the rail lets it be.

Amplitudes are largest commands (PWM fraction). At low frequencies the rail is too short for them:
there a wave is weaker, so that the cart stays within a third of the rail (`limit_amplitude`).

Arguments that the functions share:
room: what a plan must know of the rig.
t: (n,) s, evenly spaced times from the wave's start, at least two.
random: draws phases and sizes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import LARGEST_PWM, Rig

# evenly spaced times from the wave's start, s (at least two) -> commands
Wave = Callable[[Floats], Floats]

TONES_HZ = (0.31, 0.47, 0.73, 1.09, 1.51, 2.03, 2.69, 3.37)
PUSH, PUSH_S = 0.3, 0.15  # PWM fraction and length of the first push
LEAD_S = 0.3  # rest before it, so that delay and lag begin with nothing under way
LONGEST_HOLD_S = 0.45  # of a step
EDGE_S = 0.5  # in which many tones fade in and out


@dataclass(frozen=True)
class Envelope:
    """Hold what a plan must know of the rig, roughly; table 1 of the thesis gives the defaults.

    limit: largest command, PWM fraction.
    acceleration_m_s2: of the cart per unit of command (p1/m).
    swing_hz: of the hanging pole by itself.
    half_length_m: of the rail, from its middle to either end.
    unit: command that does as much as a PWM fraction of 1.
    """

    limit: float = 0.5
    acceleration_m_s2: float = 18.6
    swing_hz: float = 1.07
    half_length_m: float = 0.9
    unit: float = 1.0


def make_envelope(rig: Rig) -> Envelope:
    """Return the envelope of a rig; raise BadInputError without cart, drive or rail length.

    A limit that is no PWM fraction counts as one of 0.5. A PWM fraction means the same whatever
    the rig's limit is, so its unit stays 1.
    """
    if not rig.force_per_pwm_n or rig.rail_half_length_m is None:
        raise BadInputError(
            "excitation: expected a rig with a cart, force_per_pwm_n above 0 and "
            "rail_half_length_m, found one missing"
        )
    usual = Envelope()
    limit = rig.pwm_limit or usual.limit
    turning = rig.total_mass_kg * rig.gravity_m_s2 * (rig.com_distance_m or 0.0)
    swing_hz = (
        math.sqrt(turning / rig.pole_inertia_kg_m2) / (2 * math.pi)
        if rig.pole_inertia_kg_m2
        else 0.0
    )
    return Envelope(
        limit,
        rig.force_per_pwm_n / rig.total_mass_kg,
        swing_hz or usual.swing_hz,
        rig.rail_half_length_m,
        limit / usual.limit if limit > LARGEST_PWM else 1.0,
    )


def make_push(room: Envelope) -> Wave:
    """Return a rest, a push the positive way, twice as long back, and again.

    The cart ends where it began.
    """

    def compute(t: Floats) -> Floats:
        since = (t - LEAD_S) / PUSH_S
        return (PUSH * room.unit) * np.select(
            [since < -1e-9, since < 1, since < 3, since < 4], [0.0, 1.0, -1.0, 1.0], 0.0
        )

    return compute


def make_rest(t: Floats) -> Floats:
    """Send nothing."""
    return np.zeros_like(t)


def limit_amplitude(room: Envelope, hz: Floats | float) -> Floats:
    """Return the largest command at hz that keeps the cart within a third of the rail."""
    acceleration = (2 * np.pi * np.asarray(hz)) ** 2 * room.half_length_m / 3
    return np.minimum(room.limit, acceleration / room.acceleration_m_s2)


def make_sweep(room: Envelope, first_hz: float, last_hz: float) -> Wave:
    """Return a sweep of rising (or falling) frequency, weaker about the pole's own frequency."""

    def compute(t: Floats) -> Floats:
        hz, phase = _compute_glide(t, first_hz, last_hz)
        # strength breathes, so that limits and dead zones are passed at every frequency
        breath = 0.8 + 0.2 * np.cos(2 * np.pi * t / 1.7)
        return limit_amplitude(room, hz) * spare_resonance(room, hz) * breath * np.cos(phase)

    return compute


def spare_resonance(room: Envelope, hz: Floats) -> Floats:
    """Return the factor by which a sweep is weaker about the pole's own frequency.

    At full strength the pole goes round within a second and stays near upright too often, where a
    run magnifies every small error of its start: measured, by up to 100 within a second, and by 20
    with this factor.
    """
    return 1 - 0.7 * np.exp(-((np.log(hz / room.swing_hz) / 0.35) ** 2))


def make_chirp(room: Envelope, first_hz: float, last_hz: float, amplitude: float) -> Wave:
    """Return a sweep of even amplitude, weaker only where the rail is too short for it."""

    def compute(t: Floats) -> Floats:
        hz, phase = _compute_glide(t, first_hz, last_hz)
        return np.minimum(amplitude, limit_amplitude(room, hz)) * np.cos(phase)

    return compute


def _compute_glide(t: Floats, first_hz: float, last_hz: float) -> tuple[Floats, Floats]:
    """Return frequency (Hz) and phase (rad) of a tone that glides evenly in octaves a second."""
    hz = first_hz * (last_hz / first_hz) ** (t / t[-1])
    return hz, 2 * np.pi * np.cumsum(hz) * (t[1] - t[0])


def make_tones(room: Envelope, random: np.random.Generator) -> Wave:
    """Return many tones at once, quiet: root mean squares of 5 to 20 % of the limit."""
    phases = random.uniform(0, 2 * np.pi, len(TONES_HZ))

    def compute(t: Floats) -> Floats:
        hz = np.array(TONES_HZ)
        strengths = np.minimum(0.25 * room.limit, 0.5 * limit_amplitude(room, hz))
        total = np.sum(strengths * np.cos(2 * np.pi * np.outer(t, hz) + phases), axis=1)
        loudness = 0.3 + 0.35 * (1 - np.cos(2 * np.pi * t / t[-1]))
        return 0.4 * loudness * total

    return compute


def make_multisine(
    room: Envelope, tones_hz: tuple[float, ...], amplitude: float, random: np.random.Generator
) -> Wave:
    """Return many tones with drawn phases, their sum as large as amplitude and the rail allow.

    All tones are equally strong, except that a low tone is as strong as the rail allows for it
    alone.
    """
    drawn = random.uniform(0, 2 * np.pi, len(tones_hz))

    def compute(t: Floats) -> Floats:
        turns = 2 * np.pi * np.array(tones_hz)
        waves = np.minimum(amplitude, limit_amplitude(room, np.array(tones_hz))) * np.cos(
            np.outer(t, turns) + drawn
        )
        total, travel_m = (
            np.sum(waves, axis=1),
            room.acceleration_m_s2 * np.sum(waves / turns**2, axis=1),
        )
        # a cart that followed the command alone would travel so far
        size = min(
            amplitude / np.max(np.abs(total)), room.half_length_m / 3 / np.max(np.abs(travel_m))
        )
        return size * _compute_fade(t) * total

    return compute


def _compute_fade(t: Floats) -> Floats:
    """Return a fade from 0 to 1 and back."""
    edge = min(EDGE_S, t[-1] / 4)
    return np.sin(np.pi / 2 * np.clip(np.minimum(t, t[-1] - t) / edge, 0, 1)) ** 2


def make_steps(
    room: Envelope,
    random: np.random.Generator,
    amplitude: float | None = None,
    hold_s: float = LONGEST_HOLD_S,
) -> Wave:
    """Return pairs of steps, equal and opposite, of all sizes up to amplitude, with short pauses.

    amplitude: None for the limit.
    hold_s: s, of the longest step; larger steps are shorter, as the rail demands.
    """
    largest = room.limit if amplitude is None else amplitude

    def compute(t: Floats) -> Floats:
        out, at, way = np.zeros_like(t), 0, 1.0
        rate = 1 / (t[1] - t[0])
        while at < len(t):
            size = largest * random.choice([0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0])
            longest = min(
                hold_s, math.sqrt(room.half_length_m / 4 / (size * room.acceleration_m_s2))
            )
            half = max(2, round(random.uniform(0.5, 1.0) * longest * rate))
            out[at : at + half] = way * size
            out[at + half : at + 2 * half] = -way * size
            at += 2 * half + round(random.choice([0.0, 0.0, 0.1]) * rate)
            way = -way if random.random() < 0.7 else way
        return out

    return compute


def make_swing(room: Envelope) -> Wave:
    """Return ever stronger bursts about the pole's own frequency: it swings high or goes round."""

    def compute(t: Floats) -> Floats:
        strength = np.array([0.3, 0.6, 1.0])[np.minimum((3 * t / (t[-1] + 1e-9)).astype(int), 2)]
        hz = room.swing_hz * (1 - 0.12 * strength)
        phase = 2 * np.pi * np.cumsum(hz) * (t[1] - t[0])
        return strength * limit_amplitude(room, room.swing_hz) * np.cos(phase)

    return compute


def make_kick(room: Envelope, amplitude: float) -> Wave:
    """Return swings at the pole's own frequency, weaker where the rail demands.

    After whole periods, whose length `compute_kick_s` gives, the cart ends at rest.
    """

    def compute(t: Floats) -> Floats:
        return np.minimum(amplitude, limit_amplitude(room, room.swing_hz)) * np.cos(
            2 * np.pi * room.swing_hz * t
        )

    return compute


def compute_kick_s(room: Envelope, swings: int) -> float:
    """Return the time, s, of so many swings of the pole."""
    return swings / room.swing_hz

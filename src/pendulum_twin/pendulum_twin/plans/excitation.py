"""Plan the commands that separate a rig's physics, and keep the cart on the rail meanwhile.

A minute of the standard plan has: a short push to see which way the cart goes; sweeps, whose cart
reversals happen at many speeds; quiet many-tone phases, where dry friction and dead zones show;
steps of all sizes up to the limit, where gain, lag and saturation show; swinging the pole high at
its own frequency; and rests, in which the pole swings out by itself. `plan_file` reads plans of a
user's own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans import waveforms
from pendulum_twin.plans.waveforms import LEAD_S, PUSH_S, Envelope, Wave, make_push, make_rest

SHORTEST_S = 40.0
SLOWEST_HZ = 20.0
STIFFNESS = 0.12  # PWM fraction per m: weak, beside a limit of 0.5
DAMPING = 0.08  # PWM fraction per m/s, as weak
WALL_STIFFNESS = 0.6  # PWM fraction per m beyond the free part of the rail
LEAST_TRAVEL_M = 0.003  # below it the push does not show the direction
FREE_SHARE = 0.3  # of the half rail: beyond it the cart is sent back even in rests


@dataclass(frozen=True)
class Stretch:
    """Hold a stretch of a plan.

    name: of its kind.
    commands: (n,) PWM fraction, one a sample period.
    centred: whether a weak push towards the middle is added.
    """

    name: str
    commands: Floats
    centred: bool


@dataclass(frozen=True)
class Excitation:
    """Hold a plan.

    commands: (n,) PWM fraction, one a sample period.
    centring: (n,) how strongly each sample is centred, 0 to 1.
    rate_hz: samples a second.
    limit: largest command.
    push_ends: sample at which the first push has moved the cart; None for a plan without a push,
        in which nothing is centred or sent back.
    free_m: m from the middle, beyond which the cart is sent back even in rests.
    stretches: name of each stretch and the sample after its last, in order.
    unit: command that does as much as a PWM fraction of 1.
    """

    commands: Floats
    centring: Floats
    rate_hz: float
    limit: float
    push_ends: int | None
    free_m: float
    stretches: tuple[tuple[str, int], ...] = ()
    unit: float = 1.0

    @property
    def seconds(self) -> float:
        """Return the plan's length, s."""
        return len(self.commands) / self.rate_hz

    def get_stretch(self, k: int) -> str:
        """Return the name of the stretch that sample k belongs to; nothing after the last."""
        return next((name for name, end in self.stretches if k < end), "")


def compose_plan(
    stretches: Sequence[Stretch], rate_hz: float, room: Envelope, pushed: bool
) -> Excitation:
    """Return stretches one after another as a plan.

    pushed: whether it begins with `make_push`, which shows the direction of the cart.
    """
    ends = np.cumsum([len(stretch.commands) for stretch in stretches]).tolist()
    commands = np.concatenate([stretch.commands for stretch in stretches])
    return Excitation(
        np.clip(commands, -room.limit, room.limit),
        np.concatenate([np.full(len(s.commands), float(s.centred)) for s in stretches]),
        rate_hz,
        room.limit,
        round((LEAD_S + 2 * PUSH_S) * rate_hz) if pushed else None,
        FREE_SHARE * room.half_length_m,
        tuple((stretch.name, end) for stretch, end in zip(stretches, ends, strict=True)),
        room.unit,
    )


def make_standard_plan(
    room: Envelope = Envelope(),  # noqa: B008 (frozen)
    seconds: float = 60.0,
    rate_hz: float = 100.0,
    seed: int = 0,
) -> Excitation:
    """Return the standard plan, stretched to its length, s; the seed draws phases and step sizes.

    Raises BadInputError for a plan shorter than its phases can be.
    """
    return compose_plan(
        make_standard_pieces(room, seconds, rate_hz, seed), rate_hz, room, pushed=True
    )


def make_standard_pieces(
    room: Envelope, seconds: float, rate_hz: float, seed: int
) -> list[Stretch]:
    """Return the stretches of the standard plan; see `make_standard_plan`."""
    if not seconds >= SHORTEST_S or not rate_hz >= SLOWEST_HZ:
        raise BadInputError(
            f"excitation: expected at least {SHORTEST_S:g} s and {SLOWEST_HZ:g} Hz, "
            f"found {seconds:g} s and {rate_hz:g} Hz"
        )
    random = np.random.default_rng(seed)
    # name, share of the plan's length, commands, centred
    waves: tuple[tuple[str, float, Wave, bool], ...] = (
        ("push", 0.025, make_push(room), False),
        ("rising sweep", 0.20, waveforms.make_sweep(room, 0.3, 3.0), True),
        ("rest", 0.065, make_rest, False),
        ("tones", 0.13, waveforms.make_tones(room, random), True),
        ("steps", 0.17, waveforms.make_steps(room, random), True),
        ("rest", 0.055, make_rest, False),
        ("swing", 0.14, waveforms.make_swing(room), True),
        ("rest", 0.075, make_rest, False),
        ("falling sweep", 0.11, waveforms.make_sweep(room, 3.2, 0.4), True),
        ("rest", 0.03, make_rest, False),
    )
    ends = np.round(np.cumsum([share for _, share, _, _ in waves]) * seconds * rate_hz).astype(int)
    counts = np.diff(ends, prepend=0)
    return [
        Stretch(name, wave(np.arange(n) / rate_hz), centred)
        for n, (name, _, wave, centred) in zip(counts, waves, strict=True)
    ]


def compute_command(plan: Excitation, k: int, cart_m: float, cart_m_s: float, way: int) -> float:
    """Return the command of sample k: the plan's, and a weak push towards the middle of the rail.

    cart_m, cart_m_s: measured position and velocity of the cart.
    way: direction in which a positive command moves the measured cart, see
        `find_command_direction`; with 0 (unknown) nothing is centred.
    """
    inwards = plan.centring[k] * (STIFFNESS * cart_m + DAMPING * cart_m_s)
    beyond = cart_m - min(max(cart_m, -plan.free_m), plan.free_m)
    if beyond:
        inwards += WALL_STIFFNESS * beyond + DAMPING * cart_m_s * (1 - plan.centring[k])
    return min(max(float(plan.commands[k]) - way * plan.unit * inwards, -plan.limit), plan.limit)


def find_command_direction(travel_m: float) -> int:
    """Return the direction in which a positive command moves the measured cart, 1, -1 or 0.

    travel_m: of the cart in the first push; 0 is returned when it is too short to show.
    """
    return 0 if abs(travel_m) < LEAST_TRAVEL_M else int(math.copysign(1, travel_m))

"""What to send to a rig so that its recording tells its physics apart, and how to keep the cart on the rail meanwhile.

A minute has: a short push to see which way the cart goes; sweeps, whose cart reversals happen at many speeds; quiet
many-tone phases, where dry friction and dead zones show; steps of all sizes up to the limit, where gain, lag and
saturation show; swinging the pole high at its own frequency; and rests, in which the pole swings out by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.errors import BadInputError

Floats = NDArray[np.float64]
Phase = Callable[[Floats], Floats]  # times from the phase's start, s -> commands

SHORTEST_S = 40.0
TONES_HZ = np.array([0.31, 0.47, 0.73, 1.09, 1.51, 2.03, 2.69, 3.37])
STIFFNESS = 0.12  # command per m, of the limit 0.5: weak
DAMPING = 0.08  # command per m/s
WALL_STIFFNESS = 0.6  # command per m beyond the free part of the rail
PUSH, PUSH_S = 0.3, 0.15  # command and length of the first push
LEAD_S = 0.3  # rest before it, so that delay and lag begin with nothing under way
LEAST_TRAVEL_M = 0.003  # below it the push says nothing


@dataclass(frozen=True)
class Excitation:
    """Hold a plan: commands (PWM fraction, one a sample period) and how strongly each sample is centred, 0 to 1.

    push_ends: sample at which the first push has moved the cart one way. free_m: distance from the middle beyond which
    the cart is sent back even in rests.
    """

    commands: Floats
    centring: Floats
    rate_hz: float
    limit: float
    push_ends: int
    free_m: float


@dataclass(frozen=True)
class Envelope:
    """Hold what a plan must know of the rig, roughly.

    limit: largest command. acceleration_m_s2: of the cart per unit of command (p1/m). swing_hz: of the hanging pole
    when it swings by itself. half_length_m: of the rail. Table 1 gives the defaults.
    """

    limit: float = 0.5
    acceleration_m_s2: float = 18.6
    swing_hz: float = 1.07
    half_length_m: float = 0.9


def standard(room: Envelope = Envelope(), seconds: float = 60.0, rate_hz: float = 100.0, seed: int = 0) -> Excitation:
    """Return the standard plan, stretched to its length in s; the seed moves phases and step sizes.

    Raises BadInputError for a plan shorter than its phases can be.
    """
    if not seconds >= SHORTEST_S or not rate_hz >= 20:
        raise BadInputError(
            f"excitation: expected at least {SHORTEST_S:g} s and 20 Hz, found {seconds:g} s and {rate_hz:g} Hz"
        )
    random = np.random.default_rng(seed)
    phases = (  # share of the whole, commands of so many samples, centred
        (0.025, push, False),
        (0.20, sweep(room, 0.3, 3.0), True),
        (0.065, rest, False),
        (0.13, tones(room, random), True),
        (0.17, steps(room, random), True),
        (0.055, rest, False),
        (0.14, swing(room), True),
        (0.075, rest, False),
        (0.11, sweep(room, 3.2, 0.4), True),
        (0.03, rest, False),
    )
    ends = np.round(np.cumsum([share for share, _, _ in phases]) * seconds * rate_hz).astype(int)
    counts = np.diff(ends, prepend=0)
    commands = [make(np.arange(n) / rate_hz) for n, (_, make, _) in zip(counts, phases, strict=True)]
    centring = [np.full(n, float(on)) for n, (_, _, on) in zip(counts, phases, strict=True)]
    return Excitation(
        np.clip(np.concatenate(commands), -room.limit, room.limit),
        np.concatenate(centring),
        rate_hz,
        room.limit,
        round((LEAD_S + 2 * PUSH_S) * rate_hz),
        0.3 * room.half_length_m,
    )


def next_command(plan: Excitation, k: int, cart_m: float, cart_m_s: float, way: int) -> float:
    """Return the command of sample k: the plan's, and a weak push towards the middle of the rail.

    way: which way a positive command moves the measured cart, see `way_of`; with 0 (unknown) nothing is centred.
    """
    inwards = plan.centring[k] * (STIFFNESS * cart_m + DAMPING * cart_m_s)
    beyond = cart_m - min(max(cart_m, -plan.free_m), plan.free_m)
    if beyond:
        inwards += WALL_STIFFNESS * beyond + DAMPING * cart_m_s * (1 - plan.centring[k])
    return min(max(float(plan.commands[k]) - way * inwards, -plan.limit), plan.limit)


def way_of(travel_m: float) -> int:
    """Return which way a positive command moves the measured cart (+1 or -1), from its travel in the first push."""
    return 0 if abs(travel_m) < LEAST_TRAVEL_M else int(math.copysign(1, travel_m))


def push(t: Floats) -> Floats:
    """Rest; push the positive way, twice as long back, and once more: the cart ends at rest, about where it began."""
    since = (t - LEAD_S) / PUSH_S
    return PUSH * np.select([since < -1e-9, since < 1, since < 3, since < 4], [0.0, 1.0, -1.0, 1.0], 0.0)


def rest(t: Floats) -> Floats:
    """Send nothing."""
    return np.zeros_like(t)


def reach(room: Envelope, hz: Floats | float) -> Floats:
    """Return the largest command of a frequency that keeps the cart within a third of the rail, and in the limit."""
    acceleration = (2 * np.pi * np.asarray(hz)) ** 2 * room.half_length_m / 3
    return np.minimum(room.limit, acceleration / room.acceleration_m_s2)


def sweep(room: Envelope, first_hz: float, last_hz: float) -> Phase:
    """Return a sweep of rising (or falling) frequency, as strong as the rail lets it be."""

    def commands(t: Floats) -> Floats:
        hz = first_hz * (last_hz / first_hz) ** (t / t[-1])
        phase = 2 * np.pi * np.cumsum(hz) * (t[1] - t[0])
        # strength breathes, so that limits and dead zones are passed at every frequency
        breath = 0.8 + 0.2 * np.cos(2 * np.pi * t / 1.7)
        return reach(room, hz) * spared(room, hz) * breath * np.cos(phase)

    return commands


def spared(room: Envelope, hz: Floats) -> Floats:
    """Return how much weaker a sweep is about the pole's own frequency.

    At full strength there the pole goes round within a second and stays near upright too often, where a run magnifies
    every small error of its start: measured, by up to 100 within a second, and by 20 with this.
    """
    return 1 - 0.7 * np.exp(-((np.log(hz / room.swing_hz) / 0.35) ** 2))


def tones(room: Envelope, random: np.random.Generator) -> Phase:
    """Return many tones at once, quiet: root mean squares of 5 to 20 % of the limit."""
    phases = random.uniform(0, 2 * np.pi, len(TONES_HZ))

    def commands(t: Floats) -> Floats:
        parts = np.minimum(0.25 * room.limit, 0.5 * reach(room, TONES_HZ))
        total = np.sum(parts * np.cos(2 * np.pi * np.outer(t, TONES_HZ) + phases), axis=1)
        loudness = 0.3 + 0.35 * (1 - np.cos(2 * np.pi * t / t[-1]))
        return 0.4 * loudness * total

    return commands


def steps(room: Envelope, random: np.random.Generator) -> Phase:
    """Return pairs of steps of equal size and opposite way, of all sizes up to the limit, with short pauses."""

    def commands(t: Floats) -> Floats:
        out, at, way = np.zeros_like(t), 0, 1.0
        rate = 1 / (t[1] - t[0])
        while at < len(t):
            size = room.limit * random.choice([0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0])
            longest = min(0.45, math.sqrt(room.half_length_m / 4 / (size * room.acceleration_m_s2)))
            half = max(2, round(random.uniform(0.5, 1.0) * longest * rate))
            out[at : at + half] = way * size
            out[at + half : at + 2 * half] = -way * size
            at += 2 * half + round(random.choice([0.0, 0.0, 0.1]) * rate)
            way = -way if random.random() < 0.7 else way
        return out

    return commands


def swing(room: Envelope) -> Phase:
    """Return bursts about the pole's own frequency, each stronger than the last: the pole swings high or goes round."""

    def commands(t: Floats) -> Floats:
        strength = np.array([0.3, 0.6, 1.0])[np.minimum((3 * t / (t[-1] + 1e-9)).astype(int), 2)]
        hz = room.swing_hz * (1 - 0.12 * strength)
        phase = 2 * np.pi * np.cumsum(hz) * (t[1] - t[0])
        return strength * reach(room, room.swing_hz) * np.cos(phase)

    return commands

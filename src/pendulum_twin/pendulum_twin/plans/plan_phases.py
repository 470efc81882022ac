"""Define the kinds of phases of a plan: their keys, the checks of these, and their commands.

Each kind is a frozen dataclass whose fields are its keys in a plan file (`plan_file`); a wrong
value raises BadInputError.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass
from typing import Any, ClassVar, Protocol

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans import waveforms
from pendulum_twin.plans.excitation import SHORTEST_S, Stretch, make_standard_pieces
from pendulum_twin.plans.plan_keys import (
    check_keys,
    make_flag_key,
    make_number_key,
    make_numbers_key,
    make_whole_key,
)
from pendulum_twin.plans.waveforms import LEAD_S, LONGEST_HOLD_S, PUSH_S, TONES_HZ, Envelope, Wave

BRIEFEST_S, LONGEST_S = 0.1, 3600.0
MOST_SAMPLES, MOST_TONES = 1_000_000, 100
WHOLE_PUSH_S = LEAD_S + 4 * PUSH_S


class Phase(Protocol):
    """Offer what every kind of phase does; its fields are its keys in a plan file."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return its stretches; raise BadInputError when the rig or the rate forbids them."""


def _make_seconds_key(default: Any = MISSING, least: float = BRIEFEST_S) -> Any:
    return make_number_key(least, LONGEST_S, default)


def _make_stretch(name: str, wave: Wave, seconds: float, rate_hz: float, centred: bool) -> Stretch:
    """Return a wave as a stretch of at least two samples, for waves need a period."""
    return Stretch(name, wave(np.arange(max(2, round(seconds * rate_hz))) / rate_hz), centred)


def _check_amplitude(amplitude: float, room: Envelope) -> float:
    """Return an amplitude within the limit; raise BadInputError for a larger amplitude."""
    if amplitude > room.limit:
        raise BadInputError(
            f"amplitude: expected at most the limit {room.limit:g}, found {amplitude:g}"
        )
    return amplitude


def _check_frequency(name: str, hz: float, rate_hz: float) -> None:
    """Raise BadInputError for a frequency above half of the rate."""
    if hz > rate_hz / 2:
        raise BadInputError(
            f"{name}: expected at most {rate_hz / 2:g} Hz, half of rate_hz, found {hz:g}"
        )


@dataclass(frozen=True, kw_only=True)
class Push:
    """Push back and forth at a plan's start: it shows the direction of the cart."""

    seconds: float = _make_seconds_key(1.5, WHOLE_PUSH_S)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the push and the rest after it."""
        return [_make_stretch("push", waveforms.make_push(room), self.seconds, rate_hz, False)]


@dataclass(frozen=True, kw_only=True)
class Rest:
    """Send nothing; when centred, bring the cart back towards the middle."""

    seconds: float = _make_seconds_key()
    centred: bool = make_flag_key(False)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the rest."""
        return [_make_stretch("rest", waveforms.make_rest, self.seconds, rate_hz, self.centred)]


@dataclass(frozen=True, kw_only=True)
class Chirp:
    """Glide a tone from a frequency to another, evenly in octaves a second, up or down."""

    seconds: float = _make_seconds_key()
    from_hz: float = make_number_key(0.01, 500.0)
    to_hz: float = make_number_key(0.01, 500.0)
    amplitude: float = make_number_key(0.001, 1e6)
    centred: bool = make_flag_key(True)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the sweep."""
        _check_frequency("from_hz", self.from_hz, rate_hz)
        _check_frequency("to_hz", self.to_hz, rate_hz)
        wave = waveforms.make_chirp(
            room, self.from_hz, self.to_hz, _check_amplitude(self.amplitude, room)
        )
        return [_make_stretch("chirp", wave, self.seconds, rate_hz, self.centred)]


@dataclass(frozen=True, kw_only=True)
class Multisine:
    """Send many tones at once, their phases drawn by the seed; amplitude: of their sum."""

    seconds: float = _make_seconds_key()
    amplitude: float = make_number_key(0.001, 1e6)
    tones_hz: tuple[float, ...] = make_numbers_key(0.01, 500.0, MOST_TONES, TONES_HZ)
    seed: int = make_whole_key(0, 2**32 - 1, 0)
    centred: bool = make_flag_key(True)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the tones."""
        for k, hz in enumerate(self.tones_hz):
            _check_frequency(f"tones_hz[{k}]", hz, rate_hz)
        wave = waveforms.make_multisine(
            room,
            self.tones_hz,
            _check_amplitude(self.amplitude, room),
            np.random.default_rng(self.seed),
        )
        return [_make_stretch("multisine", wave, self.seconds, rate_hz, self.centred)]


@dataclass(frozen=True, kw_only=True)
class Steps:
    """Send pairs of steps, forth and back, of drawn sizes up to amplitude, hold_s at most."""

    seconds: float = _make_seconds_key()
    amplitude: float = make_number_key(0.001, 1e6)
    hold_s: float = make_number_key(0.02, 10.0, LONGEST_HOLD_S)
    seed: int = make_whole_key(0, 2**32 - 1, 0)
    centred: bool = make_flag_key(True)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the steps."""
        wave = waveforms.make_steps(
            room,
            np.random.default_rng(self.seed),
            _check_amplitude(self.amplitude, room),
            self.hold_s,
        )
        return [_make_stretch("steps", wave, self.seconds, rate_hz, self.centred)]


@dataclass(frozen=True, kw_only=True)
class FreeDecay:
    """Make the pole swing at its own frequency, then send nothing while it swings out."""

    seconds: float = _make_seconds_key()
    amplitude: float = make_number_key(0.001, 1e6)
    swings: int = make_whole_key(1, 100, 2)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the kick and the decay."""
        kicked_s = waveforms.compute_kick_s(room, self.swings)
        if not kicked_s + BRIEFEST_S <= self.seconds:
            raise BadInputError(
                f"seconds: expected more than the {kicked_s:.3g} s that "
                f"{self.swings} swings take, "
                f"found {self.seconds:g}"
            )
        kicked = _make_stretch(
            "kick",
            waveforms.make_kick(room, _check_amplitude(self.amplitude, room)),
            kicked_s,
            rate_hz,
            False,
        )
        return [
            kicked,
            _make_stretch(
                "free decay", waveforms.make_rest, self.seconds - kicked_s, rate_hz, False
            ),
        ]


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Send commands as they are listed, one a sample period."""

    commands: tuple[float, ...] = make_numbers_key(-1e6, 1e6, MOST_SAMPLES)
    centred: bool = make_flag_key(True)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return the commands; raise BadInputError for one beyond the limit."""
        commands: Floats = np.array(self.commands)
        beyond = np.flatnonzero(np.abs(commands) > room.limit)
        if len(beyond):
            k = beyond[0]
            raise BadInputError(
                f"commands[{k}]: expected from {-room.limit:g} to {room.limit:g}, "
                f"found {commands[k]:g}"
            )
        return [Stretch("samples", commands, self.centred)]


@dataclass(frozen=True, kw_only=True)
class Standard:
    """Play the standard plan, which begins with a push of its own."""

    seconds: float = _make_seconds_key(60.0, SHORTEST_S)
    seed: int = make_whole_key(0, 2**32 - 1, 0)

    def __post_init__(self) -> None:
        check_keys(self)

    def make_stretches(self, room: Envelope, rate_hz: float) -> list[Stretch]:
        """Return all its stretches."""
        return make_standard_pieces(room, self.seconds, rate_hz, self.seed)


KINDS: Mapping[str, type[Phase]] = {
    "push": Push,
    "rest": Rest,
    "chirp": Chirp,
    "multisine": Multisine,
    "steps": Steps,
    "free_decay": FreeDecay,
    "samples": Samples,
    "standard": Standard,
}
BEGINNINGS = (Push, Standard)  # the phases that show the direction of the cart

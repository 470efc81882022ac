"""What a rig did, on one clock: validated, read-only arrays."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.errors import BadInputError

MOST_PERIOD_DIFFERENCE = 0.01  # of the period, between recordings of one rate


@dataclass(frozen=True)
class Signals:
    """Hold command and measured positions of one or several stretches on a uniform clock.

    Arrays have one entry a sample, shape (n,), and are read-only.

    period_s: s from sample to sample.
    command: PWM fraction (or volts, as in the twin file), held from its sample to the next.
    cart: m, position along the rail, 0 in the middle; None when the recording has no cart.
    pole: rad, angle, 0 upright, counterclockwise positive, hanging at pi, not wrapped; None when
        the recording has no pole.
    cart_valid, pole_valid: False where the sample was missing, a spike or stale; its value is a
        placeholder.
    stretch_begins: first sample of every stretch; stretch_begins[0] is 0. A gap, a jump of the
        recording or another bag begins a new stretch; nothing is carried over into it.
    begin_s: s, when every stretch begins on the clock of its recording, 0 at that recording's
        start; None when the stretches follow each other without a gap.
    after_s: s, length of all recordings before that of each stretch; None when there are none.
    parts: (n, k) the command in k equal parts of each period, where commands come faster than
        samples; `command` is their mean. None where the command is held for whole periods.
    interpolated: whether samples lie between those that were taken, at uneven times: where the
        motion bends they are off by more than the sensor's noise.

    Raises BadInputError when lengths differ, a value is not finite or neither cart nor pole is
    there.
    """

    period_s: float
    command: Floats
    cart: Floats | None
    pole: Floats | None
    cart_valid: Mask
    pole_valid: Mask
    stretch_begins: tuple[int, ...] = (0,)
    begin_s: tuple[float, ...] | None = None
    after_s: tuple[float, ...] | None = None
    parts: Floats | None = None
    interpolated: bool = False

    def __post_init__(self) -> None:
        if self.cart is None and self.pole is None:
            raise BadInputError("expected a cart or a pole in the recording, found neither")
        if not self.period_s > 0:
            raise BadInputError(f"expected a sample period above 0 s, found {self.period_s}")
        for name in ("command", "cart", "pole", "cart_valid", "pole_valid"):
            values = getattr(self, name)
            if values is None:
                continue
            values = np.array(values, dtype=bool if name.endswith("valid") else np.float64)
            if values.shape != (len(self.command),):
                raise BadInputError(
                    f"expected {len(self.command)} samples of {name}, "
                    f"found an array of shape {values.shape}"
                )
            if not np.all(np.isfinite(values)):
                raise BadInputError(f"expected finite values of {name}, found NaN or infinity")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        if self.parts is not None and len(self.parts) != len(self.command):
            raise BadInputError(
                f"expected parts of {len(self.command)} periods, found {len(self.parts)}"
            )
        begins = self.stretch_begins
        if (
            not begins
            or begins[0] != 0
            or list(begins) != sorted(set(begins))
            or begins[-1] >= max(len(self), 1)
        ):
            raise BadInputError(
                f"expected rising stretch_begins from 0 to {len(self) - 1}, found {begins}"
            )
        for name in ("begin_s", "after_s"):
            values = getattr(self, name)
            if values is not None and len(values) != len(begins):
                raise BadInputError(
                    f"expected {name} of {len(begins)} stretches, found {len(values)}"
                )

    def __len__(self) -> int:
        return len(self.command)

    @property
    def command_parts(self) -> Floats:
        """Return the command in equal parts of each period, (n, k); k is 1 for whole periods."""
        return self.command[:, None] if self.parts is None else self.parts

    @property
    def seconds(self) -> float:
        """Return the length in s."""
        return len(self) * self.period_s

    @property
    def end_s(self) -> float:
        """Return when the last period ends, s, counted through all recordings, gaps included."""
        return (
            self._after_s[-1]
            + self._begin_s[-1]
            + (len(self) - self.stretch_begins[-1]) * self.period_s
        )

    @property
    def clock_s(self) -> Floats:
        """Return the time of every sample, s, on the clock of its recording, (n,)."""
        return self._compute_times(self._begin_s)

    @property
    def times_s(self) -> Floats:
        """Return the time of every sample, s, counted through all recordings, (n,)."""
        return self._compute_times(
            tuple(a + b for a, b in zip(self._begin_s, self._after_s, strict=True))
        )

    @property
    def _begin_s(self) -> tuple[float, ...]:
        return (
            tuple(k * self.period_s for k in self.stretch_begins)
            if self.begin_s is None
            else self.begin_s
        )

    @property
    def _after_s(self) -> tuple[float, ...]:
        return (0.0,) * len(self.stretch_begins) if self.after_s is None else self.after_s

    def _compute_times(self, begin_s: tuple[float, ...]) -> Floats:
        pieces = [
            b + np.arange(s.stop - s.start) * self.period_s
            for s, b in zip(self.stretches, begin_s, strict=True)
        ]
        return np.concatenate(pieces)

    def break_at(self, samples: Iterable[int]) -> Signals:
        """Return the recording with further stretches that begin at these samples."""
        begins = tuple(sorted({*self.stretch_begins, *samples}))
        stretch = np.searchsorted(self.stretch_begins, begins, side="right") - 1
        begin_s = tuple(
            self._begin_s[s] + (k - self.stretch_begins[s]) * self.period_s
            for k, s in zip(begins, stretch.tolist(), strict=True)
        )
        return replace(
            self,
            stretch_begins=begins,
            begin_s=begin_s,
            after_s=tuple(self._after_s[s] for s in stretch.tolist()),
        )

    def cut(self, pieces: Sequence[tuple[int, int]]) -> Signals:
        """Return pieces of the recording, each a stretch of its own; pieces may overlap.

        pieces: first sample of each, and the sample after its last.
        """
        at = np.concatenate([np.arange(first, stop) for first, stop in pieces])
        first = np.array([piece[0] for piece in pieces])
        clock_s, times_s = self.clock_s[first], self.times_s[first]
        begins = np.cumsum([0, *(stop - begin for begin, stop in pieces[:-1])])
        return replace(
            self,
            command=self.command[at],
            parts=None if self.parts is None else self.parts[at],
            cart=None if self.cart is None else self.cart[at],
            pole=None if self.pole is None else self.pole[at],
            cart_valid=self.cart_valid[at],
            pole_valid=self.pole_valid[at],
            stretch_begins=tuple(begins.tolist()),
            begin_s=tuple(clock_s.tolist()),
            after_s=tuple((times_s - clock_s).tolist()),
        )

    @property
    def stretches(self) -> tuple[slice, ...]:
        """Return the stretches of samples between the breaks."""
        ends = (*self.stretch_begins[1:], len(self))
        return tuple(slice(a, b) for a, b in zip(self.stretch_begins, ends, strict=True))


def join_signals(recordings: list[Signals]) -> Signals:
    """Return several recordings of a rig as one recording, in which each is a stretch at least.

    Raises BadInputError when they differ in sample period (by more than 1 %) or in their joints.
    """
    first = recordings[0]
    for other in recordings[1:]:
        if abs(other.period_s / first.period_s - 1) > MOST_PERIOD_DIFFERENCE:
            raise BadInputError(
                f"expected recordings of one rate, found periods of {first.period_s:.6g} s and "
                f"{other.period_s:.6g} s: diagnose them one by one"
            )
        if (other.cart is None, other.pole is None) != (first.cart is None, first.pole is None):
            raise BadInputError(
                "expected recordings that all hold the same joints, "
                "found cart or pole missing in some: diagnose those with the same joints together"
            )
    if len(recordings) == 1:
        return first
    offsets = np.cumsum([0] + [len(r) for r in recordings[:-1]]).tolist()
    after = np.cumsum([0.0] + [r.end_s for r in recordings[:-1]]).tolist()

    def stack(name: str) -> NDArray:
        return np.concatenate([getattr(r, name) for r in recordings])

    return replace(
        first,
        command=stack("command"),
        cart=None if first.cart is None else stack("cart"),
        pole=None if first.pole is None else stack("pole"),
        cart_valid=stack("cart_valid"),
        pole_valid=stack("pole_valid"),
        stretch_begins=tuple(
            offset + begin
            for offset, r in zip(offsets, recordings, strict=True)
            for begin in r.stretch_begins
        ),
        begin_s=tuple(b for r in recordings for b in r._begin_s),
        after_s=tuple(a + b for a, r in zip(after, recordings, strict=True) for b in r._after_s),
        parts=_stack_parts(recordings),
        interpolated=any(r.interpolated for r in recordings),
    )


def _stack_parts(recordings: list[Signals]) -> Floats | None:
    """Return the commands in parts of the periods, as fine as the finest recording needs."""
    count = int(np.lcm.reduce([r.command_parts.shape[1] for r in recordings]))
    if count == 1:
        return None
    return np.concatenate(
        [np.repeat(r.command_parts, count // r.command_parts.shape[1], axis=1) for r in recordings]
    )

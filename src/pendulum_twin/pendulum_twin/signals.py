"""What a rig did, on one clock: validated, read-only arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Signals:
    """Hold command and measured positions of one or several stretches on a uniform clock.

    All arrays have one entry a sample, shape (n,), and are read-only.

    command: PWM fraction (or volts, as the twin file has it) held from its sample to the next.
    cart: cart position in m, positive along the rail, 0 in the middle; None when the recording has
    no cart.
    pole: pole angle in rad, 0 upright, counterclockwise positive, hanging at pi, not wrapped; None
    when no pole.
    cart_valid, pole_valid: False where the sample was missing, a spike or stale; its value is a
    placeholder.
    starts: first sample of every stretch. Nothing is carried over from one stretch to the next: a
        gap, a jump of the recording or another bag begins a new one. starts[0] is 0.
    begin_s: when every stretch begins, on the clock of its recording, 0 at that recording's start;
        None when they follow each other without a gap.
    after_s: how long the recordings before that of each stretch are, in all; None when there are
    none.

    Raises BadInputError when lengths differ, a value is not finite or neither cart nor pole is
    there.
    """

    period_s: float
    command: Floats
    cart: Floats | None
    pole: Floats | None
    cart_valid: Mask
    pole_valid: Mask
    starts: tuple[int, ...] = (0,)
    begin_s: tuple[float, ...] | None = None
    after_s: tuple[float, ...] | None = None

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
                    f"expected {len(self.command)} samples of {name}, found an array of shape {values.shape}"
                )
            if not np.all(np.isfinite(values)):
                raise BadInputError(f"expected finite values of {name}, found NaN or infinity")
            values.setflags(write=False)
            object.__setattr__(self, name, values)
        starts = self.starts
        if (
            not starts
            or starts[0] != 0
            or list(starts) != sorted(set(starts))
            or starts[-1] >= max(len(self), 1)
        ):
            raise BadInputError(
                f"expected rising starts of stretches from 0 to {len(self) - 1}, found {starts}"
            )
        for name in ("begin_s", "after_s"):
            values = getattr(self, name)
            if values is not None and len(values) != len(starts):
                raise BadInputError(
                    f"expected {name} of {len(starts)} stretches, found {len(values)}"
                )

    def __len__(self) -> int:
        return len(self.command)

    @property
    def seconds(self) -> float:
        """Return the length in s."""
        return len(self) * self.period_s

    @property
    def end_s(self) -> float:
        """Return when the last sample's period ends, counted through all recordings, gaps included."""
        return (
            self._after_s[-1] + self._begin_s[-1] + (len(self) - self.starts[-1]) * self.period_s
        )

    @property
    def clock_s(self) -> Floats:
        """Return the time of every sample on the clock of its recording, (n,)."""
        return self._times(self._begin_s)

    @property
    def times_s(self) -> Floats:
        """Return the time of every sample counted through all recordings, one after another, (n,)."""
        return self._times(tuple(a + b for a, b in zip(self._begin_s, self._after_s, strict=True)))

    @property
    def _begin_s(self) -> tuple[float, ...]:
        return (
            tuple(k * self.period_s for k in self.starts) if self.begin_s is None else self.begin_s
        )

    @property
    def _after_s(self) -> tuple[float, ...]:
        return (0.0,) * len(self.starts) if self.after_s is None else self.after_s

    def _times(self, begin_s: tuple[float, ...]) -> Floats:
        parts = [
            b + np.arange(s.stop - s.start) * self.period_s
            for s, b in zip(self.stretches, begin_s, strict=True)
        ]
        return np.concatenate(parts)

    def broken_at(self, samples: Iterable[int]) -> Signals:
        """Return the same with further stretches that begin at these samples."""
        starts = tuple(sorted({*self.starts, *samples}))
        stretch = np.searchsorted(self.starts, starts, side="right") - 1
        begin_s = tuple(
            self._begin_s[s] + (k - self.starts[s]) * self.period_s
            for k, s in zip(starts, stretch.tolist(), strict=True)
        )
        return replace(
            self,
            starts=starts,
            begin_s=begin_s,
            after_s=tuple(self._after_s[s] for s in stretch.tolist()),
        )

    @property
    def stretches(self) -> tuple[slice, ...]:
        """Return the stretches of samples between the breaks."""
        ends = (*self.starts[1:], len(self))
        return tuple(slice(a, b) for a, b in zip(self.starts, ends, strict=True))


def join_signals(parts: list[Signals]) -> Signals:
    """Return several recordings of one rig as one, each its own stretch.

    Raises BadInputError when they differ in sample period (by more than 1 %) or in what they hold.
    """
    first = parts[0]
    for part in parts[1:]:
        if abs(part.period_s / first.period_s - 1) > 0.01:
            raise BadInputError(
                f"expected recordings of one rate, found periods of {first.period_s:.6g} s and {part.period_s:.6g} s: "
                "diagnose them one by one"
            )
        if (part.cart is None, part.pole is None) != (first.cart is None, first.pole is None):
            raise BadInputError(
                "expected recordings that all hold the same joints, found cart or pole missing in some"
            )
    if len(parts) == 1:
        return first
    offsets = np.cumsum([0] + [len(p) for p in parts[:-1]])
    after = np.cumsum([0.0] + [p.end_s for p in parts[:-1]]).tolist()

    def stack(name: str) -> NDArray:
        return np.concatenate([getattr(p, name) for p in parts])

    return replace(
        first,
        command=stack("command"),
        cart=None if first.cart is None else stack("cart"),
        pole=None if first.pole is None else stack("pole"),
        cart_valid=stack("cart_valid"),
        pole_valid=stack("pole_valid"),
        starts=tuple(int(o) + s for o, p in zip(offsets, parts, strict=True) for s in p.starts),
        begin_s=tuple(b for p in parts for b in p._begin_s),
        after_s=tuple(a + b for a, p in zip(after, parts, strict=True) for b in p._after_s),
    )

"""The distance between rig and twin at the same sampling time."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass

from pendulum_bridge.view.samples import Sample, compute_period_ns


@dataclass(frozen=True)
class Mismatch:
    """Hold rig minus twin; None for a joint that either lacks.

    stamp_ns: ns; the rig's sampling time.
    apart_s: s; the twin's stamp minus the rig's.
    cart_m: m.
    pole_rad: rad, -pi to pi; the shorter way round.
    turns: whole turns by which the rig's pole is ahead.
    """

    stamp_ns: int
    apart_s: float
    cart_m: float | None
    pole_rad: float | None
    turns: int


def find_mismatch(rig: tuple[Sample, ...], twin: tuple[Sample, ...]) -> Mismatch | None:
    """Return the newest mismatch of samples whose stamps match; None without such samples.

    Stamps must rise. They match within half a period (of the longer period, if the periods
    differ). The
    twin is extrapolated over the difference by its velocity: at 1 m/s the 5 ms between nearest
        samples
    at 100 Hz would pass for 5 mm.
    """
    rig_period, twin_period = compute_period_ns(rig), compute_period_ns(twin)
    if rig_period is None or twin_period is None:
        return None
    stamps = [sample.stamp_ns for sample in twin]
    for sample in reversed(rig):
        near = twin[_find_nearest(stamps, sample.stamp_ns)]
        if abs(near.stamp_ns - sample.stamp_ns) <= max(rig_period, twin_period) / 2:
            return _subtract_samples(sample, near)
    return None


def _find_nearest(stamps: list[int], stamp_ns: int) -> int:
    after = bisect_left(stamps, stamp_ns)
    around = [k for k in (after - 1, after) if 0 <= k < len(stamps)]
    return min(around, key=lambda k: abs(stamps[k] - stamp_ns))


def _subtract_samples(rig: Sample, twin: Sample) -> Mismatch:
    apart_s = (twin.stamp_ns - rig.stamp_ns) * 1e-9
    cart_m = _subtract(rig.cart_m, _extrapolate(twin.cart_m, twin.cart_m_s, -apart_s))
    pole_rad, turns = _wrap_angle(
        _subtract(rig.pole_rad, _extrapolate(twin.pole_rad, twin.pole_rad_s, -apart_s))
    )
    return Mismatch(rig.stamp_ns, apart_s, cart_m, pole_rad, turns)


def _extrapolate(position: float | None, velocity: float | None, seconds: float) -> float | None:
    return None if position is None or velocity is None else position + velocity * seconds


def _subtract(rig: float | None, twin: float | None) -> float | None:
    if rig is None or twin is None:
        return None
    return rig - twin if math.isfinite(rig - twin) else None


def _wrap_angle(angle_rad: float | None) -> tuple[float | None, int]:
    if angle_rad is None:
        return None, 0
    nearest = math.remainder(angle_rad, 2 * math.pi)
    return nearest, round((angle_rad - nearest) / (2 * math.pi))

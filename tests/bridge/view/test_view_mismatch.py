"""The mismatch is of equal sampling times, whatever the stamps' offset, order and rate."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.view.mismatch import Mismatch, find_mismatch
from pendulum_bridge.view.samples import Sample

PERIOD_NS = 10_000_000


def sample(
    stamp_ns: int,
    cart_m: float | None = 0.0,
    pole_rad: float | None = 0.0,
    v: float = 0.0,
    w: float = 0.0,
) -> Sample:
    speeds = (None if cart_m is None else v, None if pole_rad is None else w)
    return Sample(stamp_ns, 0.0, 0.0, cart_m, pole_rad, *speeds)


def make_run(
    first_ns: int, count: int, period_ns: int = PERIOD_NS, **values: float
) -> tuple[Sample, ...]:
    return tuple(sample(first_ns + k * period_ns, **values) for k in range(count))


def find(rig: tuple[Sample, ...], twin: tuple[Sample, ...]) -> Mismatch:
    apart = find_mismatch(rig, twin)
    assert apart is not None
    return apart


def test_it_is_rig_minus_twin_at_the_newest_stamp_of_both() -> None:
    rig = (*make_run(0, 5), sample(50_000_000, 0.3, 3.0), sample(60_000_000, 9.0, 9.0))
    twin = (*make_run(0, 5), sample(50_000_000, 0.1, 3.5))  # its next sample is still on its way
    apart = find(rig, twin)
    assert (apart.stamp_ns, apart.apart_s, apart.turns) == (50_000_000, 0.0, 0)
    assert (apart.cart_m, apart.pole_rad) == pytest.approx((0.2, -0.5))


@given(st.integers(-PERIOD_NS // 2, PERIOD_NS // 2), st.floats(-2, 2), st.floats(-10, 10))
def test_equal_motion_has_no_mismatch_at_any_offset_of_the_stamps(
    offset_ns: int, v: float, w: float
) -> None:
    def moving(first_ns: int) -> tuple[Sample, ...]:
        stamps = [first_ns + k * PERIOD_NS for k in range(20)]
        return tuple(sample(t, v * t * 1e-9, w * t * 1e-9, v, w) for t in stamps)

    apart = find(moving(10**9), moving(10**9 + offset_ns))
    assert apart.cart_m == pytest.approx(0, abs=1e-9) and apart.pole_rad == pytest.approx(
        0, abs=1e-9
    )
    assert abs(apart.apart_s) <= PERIOD_NS * 0.5e-9


@pytest.mark.parametrize(("offset_ns", "matches"), [(5_000_000, True), (5_100_000, False)])
def test_stamps_match_within_half_a_period(offset_ns: int, matches: bool) -> None:
    rig = make_run(0, 4)
    assert (find_mismatch(rig, make_run(3 * PERIOD_NS + offset_ns, 3)) is not None) is matches


def test_the_longer_period_counts() -> None:
    slow = make_run(0, 4, 40_000_000)
    fast = make_run(-1_000_000, 3, 5_000_000)  # its last is 9 ms past the first slow one
    assert find(slow, fast[1:]).stamp_ns == 0
    assert find(fast, slow).stamp_ns == fast[-1].stamp_ns


@given(st.floats(-3, 3), st.integers(-4, 4))
def test_whole_turns_are_told_apart_from_the_angle(angle_rad: float, turns: int) -> None:
    rig = make_run(0, 3, pole_rad=angle_rad + turns * 2 * math.pi)
    apart = find(rig, make_run(0, 3))
    assert apart.pole_rad == pytest.approx(angle_rad, abs=1e-9) and apart.turns == turns


def test_a_joint_that_one_lacks_has_no_mismatch() -> None:
    pole_only = tuple(sample(k * PERIOD_NS, None, 3.0) for k in range(3))
    apart = find(pole_only, make_run(0, 3))
    assert apart.cart_m is None and apart.pole_rad == pytest.approx(3.0)


def test_without_two_samples_of_each_there_is_none() -> None:
    many, single = make_run(0, 5), make_run(0, 1)
    assert (
        find_mismatch(many, single) is None
        and find_mismatch(single, many) is None
        and find_mismatch((), ()) is None
    )


def test_numbers_too_large_to_subtract_have_no_mismatch() -> None:
    apart = find(
        make_run(0, 3, cart_m=1e308, pole_rad=1e308),
        make_run(0, 3, cart_m=-1e308, pole_rad=-1e308),
    )
    assert apart.cart_m is None and apart.pole_rad is None

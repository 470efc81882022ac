"""Which samples are used where stamps do not rise: few out of order, or a clock set back."""

import numpy as np
import pytest

from pendulum_sysid.reading.stamp_order import find_ordered

PERIOD_NS = 10_000_000
COUNT = 4000
EVEN = 1_650_000_000_000_000_000 + PERIOD_NS * np.arange(COUNT)


def test_stamps_in_order_are_all_used() -> None:
    assert find_ordered(EVEN).all()
    assert find_ordered(np.repeat(EVEN, 2)).all()


@pytest.mark.parametrize("off_s", [-1e6, -5.0, -0.015, 0.015, 5.0, 1e6])
@pytest.mark.parametrize("at", [1, 2000, COUNT - 2])
def test_a_wrong_stamp_leaves_its_sample_out(at: int, off_s: float) -> None:
    stamps = EVEN.copy()
    stamps[at] += round(off_s * 1e9)
    ordered = find_ordered(stamps)
    assert np.count_nonzero(~ordered) == 1 and not ordered[at - 1 : at + 2].all()
    assert np.all(np.diff(stamps[ordered]) > 0)


def test_samples_that_overtake_others_leave_few_out() -> None:
    rng = np.random.default_rng(1)
    late = np.where(rng.random(COUNT) < 0.03, rng.integers(1, 4, COUNT), 0)
    stamps = EVEN[np.argsort(np.arange(COUNT) + late + 0.1 * (late > 0), kind="stable")]
    ordered = find_ordered(stamps)
    assert 0 < np.count_nonzero(~ordered) <= np.count_nonzero(late)
    assert np.all(np.diff(stamps[ordered]) > 0)


@pytest.mark.parametrize("back_s", [0.011, 0.02, 0.5, 100.0])
def test_a_clock_that_was_set_back_is_left_as_it_is(back_s: float) -> None:
    stamps = EVEN.copy()
    stamps[2000:] -= round(back_s * 1e9)
    assert find_ordered(stamps).all()


@pytest.mark.parametrize("at", [30, COUNT - 30])
def test_samples_beside_the_end_where_the_clock_was_set_back_are_left_out(at: int) -> None:
    stamps = EVEN.copy()
    stamps[at:] -= 100 * 10**9
    before = np.arange(COUNT) < at
    np.testing.assert_array_equal(find_ordered(stamps), before if at > COUNT / 2 else ~before)


def test_a_clock_that_is_set_back_among_uneven_stamps_is_left_as_it_is() -> None:
    uneven = EVEN + np.random.default_rng(2).integers(0, PERIOD_NS // 2, COUNT)
    uneven[1500:] -= 3 * PERIOD_NS
    assert find_ordered(uneven).all()


def test_many_samples_out_of_order_are_left_as_they_are() -> None:
    assert find_ordered(np.random.default_rng(3).permutation(EVEN)).all()


def test_a_clock_that_was_set_back_among_samples_that_came_twice_is_left_as_it_is() -> None:
    stamps = np.repeat(EVEN, 3)
    stamps[6000:] -= 5 * PERIOD_NS
    assert find_ordered(stamps).all()


def test_stamps_that_never_rise_are_left_as_they_are() -> None:
    assert find_ordered(np.array([*[EVEN[0]] * 50, EVEN[0] - PERIOD_NS])).all()

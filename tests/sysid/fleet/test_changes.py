"""Change points and pooling: inject, then find; quiet histories; coverage of the truth."""

import numpy as np
import pytest

from pendulum_sysid.fleet.changes import count_changes, find_changes
from pendulum_sysid.fleet.pooling import pool_estimates, pool_family

DAYS = np.arange(60.0) * 86_400.0


def draw(course: np.ndarray, seed: int, error: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    errors = error * rng.uniform(0.6, 1.6, len(course))
    return course + errors * rng.normal(size=len(course)), errors


def test_a_step_is_found_where_it_is() -> None:
    values, errors = draw(np.where(DAYS[20] > DAYS, 0.0, 6.0), 1)
    (change,) = find_changes(DAYS, values, errors, 5).changes
    assert change.earliest < 20 <= change.latest and abs(change.index - 20) <= 1
    assert not change.drifts and change.after - change.before == pytest.approx(6.0, abs=1.0)
    assert change.chance < 0.01


def test_a_drift_that_begins_is_no_step() -> None:
    values, errors = draw(np.maximum(np.arange(60.0) - 35.0, 0.0), 2)
    (change,) = find_changes(DAYS, values, errors, 5).changes
    assert change.drifts and abs(change.index - 36) <= 2
    assert change.earliest < 36 <= change.latest


def test_a_drift_all_along_is_no_change() -> None:
    values, errors = draw(0.15 * np.arange(60.0), 3)
    course = find_changes(DAYS, values, errors, 5)
    assert course.changes == () and course.drift_chance < 0.01
    assert course.pieces[0].slope * 86_400.0 == pytest.approx(0.15, rel=0.2)


def test_a_wild_recording_is_no_change() -> None:
    values, errors = draw(np.zeros(60), 4)
    values[30] += 100.0
    assert count_changes([find_changes(DAYS, values, errors, 5)]) == 0


@pytest.mark.parametrize("factor", [1.0, 0.3])
def test_quiet_histories_stay_quiet(factor: float) -> None:
    """Also where the intervals are three times too wide: 40 sizes, 1 % of alarms expected."""
    drawn = [draw(np.zeros(30), 100 + k) for k in range(40)]
    courses = [find_changes(DAYS[:30], factor * v, e, 1) for v, e in drawn]
    assert count_changes(courses) <= 3


def test_too_wide_intervals_do_not_hide_a_change() -> None:
    values, errors = draw(np.where(DAYS[30] > DAYS, 0.0, 5.0), 5)
    assert find_changes(DAYS, 0.2 * values, errors, 5).changes


@pytest.mark.parametrize("seed", [8, 11, 22])
def test_wrong_standard_errors_make_no_change(seed: int) -> None:
    """A few estimates that claim far too much, and stand together by chance, prove nothing.

    By their likelihood alone 15 of 40 such histories change.
    """
    values, errors = draw(np.zeros(40), seed)
    errors[[3, 8, 12, 25, 31, 36]] /= 8.0
    values[[3, 8, 12]], values[[25, 31, 36]] = 0.7, -0.7
    assert count_changes([find_changes(DAYS[:40], values, errors, 1)]) == 0


def test_random_effects_hold_the_truth() -> None:
    rng, inside = np.random.default_rng(6), 0
    for _ in range(200):
        errors = rng.uniform(0.5, 2.0, 8)
        pooled = pool_estimates(5.0 + np.hypot(errors, 1.0) * rng.normal(size=8), errors)
        inside += pooled.low <= 5.0 <= pooled.high
    assert 180 <= inside <= 199


def test_a_short_recording_borrows_from_its_siblings() -> None:
    """Intervals of rigs with few recordings become narrower, and still hold the truth."""
    rng, inside, tries = np.random.default_rng(7), 0, 0
    widths = []
    for _ in range(25):
        truths = 10.0 + 0.5 * rng.normal(size=8)
        groups = []
        for truth in truths:
            errors = rng.uniform(0.5, 2.0, 4)
            groups.append((truth + errors * rng.normal(size=4), errors))
        family = pool_family(groups)
        for truth, rig, group in zip(truths, family.rigs, groups, strict=True):
            alone = pool_estimates(*group)
            widths.append((rig.high - rig.low) / (alone.high - alone.low))
            inside += rig.low <= truth <= rig.high
            tries += 1
    assert np.median(widths) < 0.6 and inside / tries > 0.9


def test_a_single_estimate_keeps_its_own_interval() -> None:
    pooled = pool_estimates(np.array([3.0]), np.array([0.5]))
    assert (pooled.value, pooled.high) == pytest.approx((3.0, 3.98), abs=1e-6)


def test_the_next_recording_is_no_surer_than_the_mean() -> None:
    """The interval of the next true value holds 95 % from two recordings on."""
    rng = np.random.default_rng(0)
    errors, hits = 0.1, {2: 0, 3: 0}
    for n in hits:
        for _ in range(400):
            *own, following = rng.normal(size=n + 1)
            pooled = pool_estimates(
                np.array(own) + errors * rng.normal(size=n), np.full(n, errors)
            )
            hits[n] += pooled.expected_low < following < pooled.expected_high
            assert pooled.expected_low <= pooled.low <= pooled.high <= pooled.expected_high
    assert all(count >= 0.92 * 400 for count in hits.values()), hits

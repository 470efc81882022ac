"""The evidence keeps its promise on false alarms and needs few windows."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.watch.evidence import (
    MOST_SHARE_A_WINDOW,
    OVERLAP_WEIGHT,
    Evidence,
    compute_ratios,
    compute_threshold,
)

WORTH = np.array([0.1])
BOTH = np.array([True])


def gathered(
    sizes: np.ndarray, information: float, evidence: Evidence, random: np.random.Generator
) -> list[float]:
    """Return the leading ratio after each window; sizes: (windows,) the true change in each."""
    found = []
    for size in sizes:
        score = random.normal(size * information, math.sqrt(information), 1)
        evidence.add(score, np.full(1, information))
        found.append(evidence.leaders()[0].ratio)
    return found


@pytest.mark.parametrize(
    "size", [0.0, 0.1, -0.1], ids=["no change", "just worth no alarm", "the other way"]
)
def test_false_alarms_are_as_rare_as_promised(size: float) -> None:
    """From any moment on, a ratio exceeds A in at most one of A runs, for each direction."""
    random, runs, windows, likelihood = np.random.default_rng(1), 4000, 60, 20.0
    score = np.cumsum(random.normal(size * 40.0, math.sqrt(40.0), (runs, windows)), axis=1)
    known = np.broadcast_to(40.0 * np.arange(1, windows + 1), score.shape)
    above = [
        np.max(compute_ratios(way * score, known, WORTH[0] * np.ones(1)), axis=1)
        > math.log(likelihood)
        for way in (1, -1)
    ]
    share = np.mean(above[0] | above[1])
    assert share < 2 / likelihood + 3 * math.sqrt(0.1 / runs)
    assert size == 0.0 or share > 0.005  # at the edge the promise is used, not wasted


def test_a_change_is_seen_after_about_the_information_that_it_takes() -> None:
    random, limit = np.random.default_rng(2), 15.0
    evidence = Evidence(WORTH, BOTH, limit)
    sizes = np.concatenate([np.zeros(80), np.full(40, 0.5)])
    found = gathered(sizes, 60.0, evidence, random)
    first = next(k for k, ratio in enumerate(found) if ratio > limit)
    each = OVERLAP_WEIGHT * 60.0 * (0.5 - 0.1) ** 2 / 2  # of log-likelihood, a window
    assert 80 + MOST_SHARE_A_WINDOW**-1 - 1 <= first <= 80 + 2 * limit / each + 2
    leader = evidence.leaders()[0]
    assert leader.size == pytest.approx(0.5, abs=4 * leader.deviation) and 30 <= leader.since <= 45


def test_a_single_window_raises_no_alarm_however_loud() -> None:
    limit = 15.0
    evidence = Evidence(WORTH, BOTH, limit)
    for k in range(60):
        evidence.add(np.full(1, 1e4 if k == 30 else 0.0), np.full(1, 50.0))
        assert evidence.leaders()[0].ratio < limit


def test_what_cannot_get_less_does_not() -> None:
    evidence = Evidence(WORTH, np.array([False]), 15.0)
    for _ in range(50):
        evidence.add(np.full(1, -30.0), np.full(1, 50.0))
    assert evidence.leaders()[0].ratio == -math.inf


def test_windows_that_say_nothing_change_nothing() -> None:
    evidence = Evidence(WORTH, BOTH, 15.0)
    for _ in range(8):
        evidence.add(np.full(1, 30.0), np.full(1, 50.0))
    before = evidence.leaders()[0]
    for _ in range(20):
        evidence.add(np.zeros(1), np.zeros(1))
    after = evidence.leaders()[0]
    assert after.ratio == before.ratio and after.since >= before.since + 20


def test_nothing_is_kept_for_ever() -> None:
    evidence = Evidence(WORTH, BOTH, 15.0)
    for _ in range(1000):
        evidence.add(np.ones(1), np.ones(1))
    assert len(evidence._scores) == len(evidence._information) <= 200


@given(st.floats(1, 1e5), st.integers(1, 500), st.floats(0.01, 1))
def test_the_threshold_is_the_number_of_chances(hours: float, tests: int, hop_s: float) -> None:
    assert math.exp(compute_threshold(tests, hours, hop_s)) == pytest.approx(
        tests * hours * 3600 / hop_s, rel=1e-6
    )

"""A computer too busy for real time: its clock is found in stamps that are late, and pauses."""

import numpy as np
import pytest
from support.degraded import make_raw, stamp, stamp_commands

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.even_clock import find_even_clock
from pendulum_sysid.cleaning.paused_clock import find_paused_clock
from pendulum_twin.arrays import Floats

PERIOD_S = 0.01
PAUSES = {1500: 0.257, 3200: 0.062}  # s, before the message of this number


def send(count: int, seed: int, pauses: dict[int, float] = PAUSES) -> tuple[Floats, Floats]:
    """Return when messages were due, and their stamps: late, and in bursts after standstills."""
    random = np.random.default_rng(seed)
    due = PERIOD_S * np.arange(count)
    for number, pause_s in pauses.items():
        due[number:] += pause_s
    free = due + random.exponential(0.004, count)
    for begin in random.uniform(0.0, due[-1], count // 60):
        end = begin + random.uniform(0.02, 0.12)  # nothing is sent while the computer stands still
        free = np.where((free > begin) & (free < end), end, free)
    stamps = free.copy()
    for k in range(1, count):
        stamps[k] = max(free[k], stamps[k - 1] + 0.0025)
    return due, stamps


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_clock_goes_on_after_a_burst_and_from_anew_after_a_pause(seed: int) -> None:
    due, stamps = send(5000, seed)
    assert find_even_clock(stamps) is None
    paused = find_paused_clock(stamps)
    assert paused is not None
    clock, sure = paused
    assert clock.period_s == pytest.approx(PERIOD_S, rel=2e-5)
    off = (clock.times_s - due)[sure]
    assert np.ptp(off) < 0.15 * PERIOD_S and off.min() > 0.0
    assert sure.mean() > 0.98 and not np.any([sure[k - 3 : k].any() for k in PAUSES])


def test_a_clock_without_pauses_is_one_piece() -> None:
    due, stamps = send(5000, 4, {})
    paused = find_paused_clock(stamps)
    assert paused is not None
    clock, sure = paused
    assert sure.all() and np.ptp(clock.times_s - due) < 0.02 * PERIOD_S


def test_stamps_without_a_period_have_no_such_clock() -> None:
    random = np.random.default_rng(5)
    assert find_paused_clock(np.cumsum(random.pareto(1.0, 2000))) is None
    assert find_paused_clock(np.zeros(2000)) is None
    assert find_paused_clock(PERIOD_S * np.arange(200)) is None


def test_a_recording_of_a_busy_computer_is_the_motion_that_it_recorded() -> None:
    raw = make_raw()
    calm = clean_recording(raw).signals
    due, stamps = send(len(raw.state_stamp_s), 6, {900: 0.257})
    moved = np.interp(raw.command_stamp_s, raw.state_stamp_s, due)
    assert find_even_clock(stamps) is None
    found = clean_recording(stamp_commands(stamp(raw, stamps), moved))
    assert {finding.kind for finding in found.findings} == {"jitter", "gap"}
    assert len(found.signals.stretches) == 2 and len(found.signals) > 0.98 * len(calm)
    assert np.array_equal(found.signals.pole[:800], calm.pole[:800])
    assert np.array_equal(found.signals.pole[-800:], calm.pole[-800:])
    assert np.array_equal(found.signals.command[-800:], calm.command[-800:])

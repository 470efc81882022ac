"""A fit to the better half of the windows holds where commands spoil many of the others."""

from dataclasses import replace

import numpy as np
from support.doubtful_commands import HELD, exchange_some, record_answers
from support.made_recordings import made

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS
from pendulum_sysid.fitting.gauss_newton import Solution, solve
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.trimmed_fit import _pick_better_half, fit_to_better_half
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

EFFECTS = tuple(HELD.effects)
TRUE = make_theta(HELD)


def fit_to_all(case: Case) -> Floats:
    """Return theta fitted to all short windows, from the truth."""
    windows = cut_windows(case.signals, case.state, WINDOW_S / HORIZONS[0], WINDOW_S / HORIZONS[0])
    free = list_free_parameters(case.twin, EFFECTS, case.scales)
    return solve(case.problem(windows), TRUE, free).theta


def measure_off(case: Case, theta: Floats) -> float:
    """Return the largest relative error of a constant or size."""
    free = list_free_parameters(case.twin, EFFECTS, case.scales)
    return max(abs(p.get(theta) / p.get(TRUE) - 1.0) for p in free)


def check_that_the_better_half_holds(case: Case) -> None:
    """Fail unless the better half is off by less than a fifth of what all windows are off."""
    bent = fit_to_all(case)
    trimmed = fit_to_better_half(case, EFFECTS, bent)
    before, after = measure_off(case, bent), measure_off(case, trimmed)
    print(f"off by {before:.2%}, by the better half {after:.2%}")
    assert before > 0.02
    assert after < 0.2 * before


def test_the_better_half_holds_where_commands_count_a_sample_off() -> None:
    raw, _ = record_answers(HELD)
    case = exchange_some(prepare_case([clean_recording(raw)], HELD), 0.2)
    check_that_the_better_half_holds(case)


def test_windows_in_which_the_cart_rests_are_not_the_better_half() -> None:
    """The cart stands still for two thirds of the time, where nothing can be off."""
    raw, _ = record_answers(HELD)
    third = len(raw.command) // 3
    rest = raw.command.copy()
    rest[third:] = 0.0
    still, _ = record_answers(HELD, rest - raw.command)
    case = prepare_case([clean_recording(replace(still, command=rest))], HELD)
    case = exchange_some(case, 0.3)
    check_that_the_better_half_holds(case)


def test_the_better_half_is_that_in_units_of_noise() -> None:
    """A cart that is off by 1 mm is far off, and a pole by 2 mrad is not."""
    off = np.array([[1e-3, 0.0], [0.0, 2e-3], [1e-3, 2e-3], [0.0, 1e-3]])
    windows = Solution(TRUE, np.zeros((4, 4)), 10.0 * off**2, np.full((4, 2), 10.0))
    assert _pick_better_half(windows, np.array([1e-4, 1e-3])).tolist() == [1, 3]


def test_a_cart_that_never_moves_changes_nothing() -> None:
    twin = Twin("pole", replace(HELD.rig, force_per_pwm_n=1e-9))
    case = prepare_case([made(HELD)], HELD)
    still = replace(case, state=replace(case.state, states=np.zeros_like(case.state.states)))
    theta = make_theta(twin)
    assert fit_to_better_half(still, EFFECTS, theta) is theta

"""Long steps of a search: runs stay within the sensors' noise, and the answer has short steps."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid import decisions
from pendulum_sysid.finding.search import search_effects
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.problem import compute_errors
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare, prepare_case
from pendulum_twin.parameter_vector import make_theta

WORST = (  # of all hidden effects; the runs of most others hardly change
    "input_delay",
    "motor_lag",
    "stretching_belt",
    "belt_backlash",
    "cart_presliding_friction",
    "cart_load_friction",
    "periodic_force",
)


@pytest.mark.parametrize("name", WORST)
def test_long_steps_change_a_run_over_a_second_by_a_part_of_the_noise(name: str) -> None:
    recording, truth = record_hidden({name: HIDDEN[name]}, 1, 14.0)
    case = prepare_case([recording], INTECO)
    windows = split_windows(case.signals, case.state).learn
    long = replace(case, step_s=decisions.SEARCH_STEP_S)
    errors, others = (
        compute_errors(each.problem(windows), make_theta(truth), windows.start_states)
        for each in (case, long)
    )
    change = np.sqrt(np.mean((errors - others) ** 2, axis=(0, 1))) / case.noise
    assert 0.0 < change.max() < 0.3


def test_the_answer_is_fitted_with_the_twins_own_steps() -> None:
    prepared = prepare([record_hidden({"input_delay": HIDDEN["input_delay"]}, 1, 14.0)[0]], INTECO)
    answer = search_effects(prepared.case, prepared.split)
    best = answer.best
    assert best.effects == ("input_delay",)
    again = fit(prepared.case, prepared.split, best.effects, best.theta, best.pieces)
    assert best.power == pytest.approx(again.power, rel=1e-4)  # 2.5 ms: 1.4e-3

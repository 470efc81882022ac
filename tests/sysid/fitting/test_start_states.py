"""Start states of windows near upright, where errors of the start grow most."""

import pytest

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.decisions import MISFIT_AT_NOISE
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon, fit_own_parameters
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.studies.proof.record_trial import record_trial
from pendulum_twin.model import load_twin
from pendulum_twin.parameter_vector import make_theta


@pytest.fixture(scope="module", params=[4, 10])
def balanced(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Prepared:
    """A controller at work near upright, an encoder of 1024 counts, nothing hidden."""
    options = ["--seed", str(request.param), "--seconds", "40", "--closed-loop"]
    options += ["--pole-counts", "1024", "--kinds", "nothing:1"]
    trial = record_trial(tmp_path_factory.mktemp("balanced"), 0, options)
    return prepare([clean_recording(read_bag(trial / "bag"))], load_twin(trial / "twin.yaml"))


def test_a_fit_over_whole_windows_goes_on_from_the_start_states_of_short_windows(
    balanced: Prepared,
) -> None:
    case, split = balanced.case, balanced.split
    near = fit(case, split, (), make_theta(case.twin), HORIZONS[0])
    far = fit_over_horizon(case, split, near, HORIZONS[-1])
    assert near.train < MISFIT_AT_NOISE and far.train < MISFIT_AT_NOISE
    assert fit_own_parameters(case, split).train == far.train
    back = fit_over_horizon(case, split, far, HORIZONS[0])
    assert back.train == pytest.approx(near.train, rel=1e-2)


def test_start_states_of_whole_windows_are_refined_to_the_noise(balanced: Prepared) -> None:
    case, split = balanced.case, balanced.split
    theta = fit_own_parameters(case, split).theta
    for windows in (split.learn, split.held_out):
        assert (
            refine_start_states(case.problem(windows), theta).misfit(case.noise) < MISFIT_AT_NOISE
        )

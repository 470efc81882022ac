"""Rivals that predict: fitted to one recording of a rig, scored on another in floors."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO
from support.prove_trials import write_trial

from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.examine_trial import (
    FILE,
    SCHEMA,
    examine_trial,
    is_complete,
    prepare_ground,
    read_examined,
)
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.rival_models import (
    elsewhere,
    gaussian_process,
    neural_state_space,
)
from pendulum_sysid.studies.proof.rival_models.elsewhere import score_rival_models
from pendulum_sysid.studies.proof.rival_models.integrate import integrate
from pendulum_sysid.studies.proof.rival_models.missing_force import (
    PushedTwin,
    compute_accelerations,
    compute_forces,
    measure_missing_force,
)
from pendulum_sysid.studies.proof.rival_models.model import (
    MOST_SCORE,
    TwinModel,
    check_both_joints,
    measure_score,
)
from pendulum_sysid.studies.proof.rival_models.registry import RIVAL_MODELS, find_rival_model
from pendulum_sysid.studies.proof.rivals import sparse_regression
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

SPRING = {"n_per_m": 3.0, "centre_m": 0.1}  # a known force that no rival knows by name
SHORT_STAGES, LONG_STAGES = ((5, 60), (20, 60)), ((40, 60),)  # of a network in a test


@pytest.fixture(scope="module")
def spring(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rig with a spring and wrong constants, recorded twice."""
    folder = tmp_path_factory.mktemp("spring")
    return write_trial(folder, {"rail_spring": SPRING}, seed=1, other=True)


@pytest.fixture(scope="module")
def ground(spring: Path) -> Ground:
    return prepare_ground(read_trial(spring))


@pytest.fixture(scope="module")
def refitted_floors(spring: Path, ground: Ground) -> float:
    return score(ground, spring, "refitted_constants")


def score(ground: Ground, trial: Path, name: str) -> float:
    entry = score_rival_models(ground, trial / "other", [name])[name]
    assert entry["error"] == ""
    return entry["floors"]


def test_refitted_constants_reach_the_floor_when_only_constants_are_wrong(tmp_path: Path) -> None:
    trial = write_trial(tmp_path, {}, seed=2, other=True)
    assert score(prepare_ground(read_trial(trial)), trial, "refitted_constants") < 1.3


def test_refitted_constants_run_better_than_the_nominal_twin(ground: Ground) -> None:
    windows = ground.split.held_out
    refitted = find_rival_model("refitted_constants").fit_model(ground)
    nominal = measure_score(TwinModel(INTECO), ground.case, windows)
    assert measure_score(refitted, ground.case, windows) < 0.5 * nominal


def test_sparse_dynamics_predict_a_spring(
    spring: Path, ground: Ground, refitted_floors: float
) -> None:
    pytest.importorskip(sparse_regression.PACKAGE)
    assert score(ground, spring, "sparse_dynamics") < 0.2 * refitted_floors


def test_a_gaussian_process_predicts_a_spring(
    spring: Path, ground: Ground, refitted_floors: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(gaussian_process.PACKAGE)
    monkeypatch.setattr(gaussian_process, "SAMPLES", 300)
    assert score(ground, spring, "gaussian_process") < 0.3 * refitted_floors


def test_a_network_predicts_a_spring(
    spring: Path, ground: Ground, refitted_floors: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(neural_state_space.PACKAGE)
    from pendulum_sysid.studies.proof.rival_models import network

    monkeypatch.setattr(network, "PRETRAINING", 200)
    monkeypatch.setattr(network, "SHORT_STAGES", SHORT_STAGES)
    monkeypatch.setattr(network, "LONG_STAGES", LONG_STAGES)
    assert score(ground, spring, "neural_state_space") < refitted_floors


def test_a_network_is_the_same_in_numpy_and_in_torch(ground: Ground) -> None:
    torch = pytest.importorskip(neural_state_space.PACKAGE)
    from pendulum_sysid.studies.proof.rival_models.network import Trainer

    trainer = Trainer(ground, decay=0.0)
    states, command = ground.case.state.states[:50], ground.case.signals.command[:50]
    with torch.no_grad():
        change = trainer.predict_change(torch.tensor(states), torch.tensor(command))
    np.testing.assert_allclose(trainer.export().predict_change(states, command), change)


# What they are built of


def test_the_missing_force_is_the_springs(ground: Ground) -> None:
    """The true constants, without the spring, lack the spring's force and no torque."""
    case = ground.case
    truth = read_truth()
    missing = measure_missing_force(case, make_theta(truth))
    at = missing.usable.copy()
    at[:50] = at[-50:] = False
    spring = SPRING["n_per_m"] * (SPRING["centre_m"] - missing.states[:, 0])
    errors = missing.forces[at, 0] - spring[at]
    assert np.sqrt(np.mean(errors**2)) < 0.1 * np.std(spring[at])


def test_a_pushed_twin_runs_as_a_twin_with_the_force(ground: Ground) -> None:
    truth, windows = read_truth(), ground.split.held_out
    with_spring = TwinModel(Twin("spring", truth.rig, {"rail_spring": SPRING}))

    def push(states: Floats, command: Floats) -> Floats:
        force = SPRING["n_per_m"] * (SPRING["centre_m"] - states[:, 0])
        return np.stack([force, np.zeros(len(states))], axis=1)

    signals = ground.case.signals
    runs = PushedTwin(make_theta(truth), push).run(signals, windows)
    expected, bare = with_spring.run(signals, windows), TwinModel(truth).run(signals, windows)
    assert np.max(np.abs(runs - expected)[..., 0]) < 1e-3 * np.max(np.abs(bare - expected)[..., 0])


def read_truth() -> Twin:
    return Twin("truth", record_hidden({}, seed=1, seconds=24.0)[1].rig)


def test_forces_are_the_inverse_of_accelerations() -> None:
    theta, angles = make_theta(INTECO), np.linspace(-3, 3, 7)
    forces = np.random.default_rng(0).normal(size=(7, 2))
    accelerations = compute_accelerations(theta, angles, forces)
    np.testing.assert_allclose(compute_forces(theta, angles, accelerations), forces)


def test_runs_are_integrated_to_the_fourth_order() -> None:
    """An oscillator, by hand: x = cos t, th = sin t."""
    n = 101
    still, every = np.zeros(n), np.ones(n, dtype=bool)
    signals = Signals(0.01, still, still, still, every, every)
    start = np.array([[1.0, 0.0, 0.0, 1.0]])
    runs = integrate(
        lambda states, command: -states[:, :2], signals, Windows(np.array([0]), n, start)
    )
    t = signals.times_s
    expected = np.stack([np.cos(t), np.sin(t), -np.sin(t), np.cos(t)], axis=1)
    np.testing.assert_allclose(runs[0], expected, atol=1e-10)


# Errors and limits


class Diverging:
    """A model whose runs end in NaN."""

    def run(self, signals: Signals, windows: Windows) -> Floats:
        return np.full((len(windows), windows.samples, 4), np.nan)


class Registered:
    """A rival in place of a registered one."""

    def __init__(self, fit_model: object) -> None:
        self.fit_model = fit_model


def test_runs_that_diverge_count_as_a_large_number(
    spring: Path, ground: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert measure_score(Diverging(), ground.case, ground.split.choose) == MOST_SCORE
    rival = Registered(lambda ground: Diverging())
    monkeypatch.setattr(elsewhere, "find_rival_model", lambda name: rival)
    entry = score_rival_models(ground, spring / "other", ["any"], floor=2.0)["any"]
    assert entry["floors"] == elsewhere.MOST_FLOORS and entry["error"] == ""


def test_a_rival_that_breaks_off_is_an_answer(
    spring: Path, ground: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    def break_off(ground: Ground) -> None:
        raise ValueError("no")

    monkeypatch.setattr(elsewhere, "find_rival_model", lambda name: Registered(break_off))
    entry = score_rival_models(ground, spring / "other", ["any"], floor=2.0)["any"]
    assert entry["floors"] is None and entry["error"] == "ValueError: no"


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for module, package in ((gaussian_process, "scikit-learn"), (neural_state_space, "torch")):
        monkeypatch.setattr(module, "PACKAGE", "no_such_package")
        with pytest.raises(BadInputError, match=rf"package {package} .*leave out --rivals"):
            module.check_installed()


def test_a_rival_asks_for_both_joints(ground: Ground) -> None:
    class OfACart:
        class case:  # noqa: N801
            signals = Signals(0.01, *[np.zeros(3)] * 2, None, *[np.ones(3, dtype=bool)] * 2)

    check_both_joints(ground)
    with pytest.raises(BadInputError, match="expected a recording of cart and pole"):
        check_both_joints(OfACart)  # type: ignore[arg-type]


def test_every_rival_says_what_it_is() -> None:
    assert len({rival.name for rival in RIVAL_MODELS}) == len(RIVAL_MODELS) == 4
    assert all(rival.sentence for rival in RIVAL_MODELS)


# Kept beside the trial


def write_examined(trial: Path) -> None:
    kept = {"schema": SCHEMA, "rivals": {}, "verdict": {}, "modelled": 1.0}
    (trial / FILE).write_text(json.dumps(kept))


def test_floors_are_kept_with_the_trial(spring: Path) -> None:
    names = ("refitted_constants",)
    write_examined(spring)
    assert not is_complete(spring, names)
    examine_trial(spring, names)
    examined = read_examined(spring)
    assert examined is not None and is_complete(spring, names)
    assert examined["rivals"] == {} and examined["modelled"] == 1.0
    assert examined["models"]["refitted_constants"]["floors"] > 1.3


def test_a_rig_that_is_recorded_once_is_not_predicted(tmp_path: Path) -> None:
    trial = write_trial(tmp_path, {}, seed=3, seconds=8.0)
    write_examined(trial)
    examine_trial(trial, ("neural_state_space",))
    examined = read_examined(trial)
    assert examined is not None
    entry = {"floors": None, "cpu_seconds": 0.0, "error": ""}
    assert examined["models"] == {"neural_state_space": entry}

"""A latent force has the size of what a twin lacks; the likelihood is that of all positions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting import latent_force
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.kalman_filter import SIZE, filter_motion
from pendulum_sysid.fitting.latent_force import linearise_predictions, measure_latent_force
from pendulum_sysid.fitting.predictions import Predictions
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Fit
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

FRICTION = "cart_coulomb_friction"
TRUTH = replace(INTECO, effects={FRICTION: {"level_n": 0.5}})
SPRING = {"n_per_m": 1.5, "centre_m": 0.25}  # of a cable along the rail, which nobody asks for
RIG = replace(TRUTH, effects={**TRUTH.effects, "rail_spring": SPRING})
SAMPLES = 40


def prepare_made(truth: Twin, seed: int) -> tuple[Prepared, Fit]:
    """Return a recording of a rig, and the fit of the twin that knows the dry friction alone."""
    prepared = prepare([made(truth, seed=seed)], TRUTH)
    theta = make_theta(prepared.case.twin)
    for pieces in (4, 1):
        fitted = fit(prepared.case, prepared.split, (FRICTION,), theta, pieces)
        theta = fitted.theta
    return prepared, fitted


@pytest.fixture(scope="module")
def pulled() -> tuple[Prepared, Fit]:
    return prepare_made(RIG, 3)


def test_the_likelihood_is_that_of_all_positions_at_once() -> None:
    """The filter's errors are white: their density is the joint density of the measurements."""
    random = np.random.default_rng(5)
    first = np.arange(SAMPLES) == 0
    predicted = (np.arange(SAMPLES) % 4 == 0) & ~first
    transitions = np.eye(4) + 0.05 * random.normal(size=(SAMPLES, 4, 4))
    pushes = 0.1 * random.normal(size=(SAMPLES, 4, 2))
    gaps = 0.01 * random.normal(size=(1, SAMPLES, 4))
    measured, counts = 0.1 * random.normal(size=(SAMPLES, 2)), np.ones((SAMPLES, 2))
    counts[8, 0] = 0.0
    start, inflow, noise = np.full(SIZE, 0.01), np.array([0.02, 0.03]), np.array([1e-3, 2e-3])
    decay, channels = 0.8, np.array([0, 1])
    white, logs = np.zeros((1, int(predicted.sum()), 2)), np.zeros(int(predicted.sum()))
    filter_motion(
        first,
        predicted,
        gaps,
        transitions,
        pushes,
        measured,
        counts,
        channels,
        start,
        decay,
        inflow,
        noise,
        white,
        logs,
    )

    mean, ways = np.zeros(SIZE), [np.diag(np.sqrt(start))]  # the state as a sum of unit noises
    shown, expected, deviations = [], [], []
    for k in range(1, SAMPLES):
        matrix = np.zeros((SIZE, SIZE))
        matrix[:4, :4], matrix[:4, 4:], matrix[4:, 4:] = (
            transitions[k],
            pushes[k],
            decay * np.eye(2),
        )
        mean = matrix @ mean + np.append(gaps[0, k], [0.0, 0.0])
        ways = [matrix @ way for way in ways] + [np.diag(np.append(np.zeros(4), np.sqrt(inflow)))]
        if predicted[k]:
            for c in range(2):
                if counts[k, c]:
                    row = np.concatenate([way[c] for way in ways])
                    shown.append(row)
                    expected.append(measured[k, c] - mean[c])
                    deviations.append(noise[c])
    longest = max(len(row) for row in shown)
    rows = np.array([np.pad(row, (0, longest - len(row))) for row in shown])
    joint = multivariate_normal(cov=rows @ rows.T + np.diag(deviations))
    likelihood = -0.5 * np.sum(white**2) - logs.sum() - 0.5 * len(rows) * np.log(2.0 * np.pi)
    assert likelihood == pytest.approx(joint.logpdf(expected), rel=1e-9)


def test_the_force_is_as_large_as_what_the_twin_lacks(pulled: tuple[Prepared, Fit]) -> None:
    """Beside the true constants the force has the size of the cable's, and no torque."""
    prepared, _ = pulled
    case = prepared.case
    latent = measure_latent_force(case, prepared.split, make_theta(TRUTH))
    pulls_n = SPRING["n_per_m"] * (case.state.states[:, 0] - SPRING["centre_m"])
    assert 0.3 < latent.force_n / np.sqrt(np.mean(pulls_n**2)) < 2.0
    assert latent.torque_n_m < 0.05 * latent.force_n


def test_nothing_missing_leaves_a_small_force(pulled: tuple[Prepared, Fit]) -> None:
    prepared, fitted = prepare_made(TRUTH, 6)
    quiet = measure_latent_force(prepared.case, prepared.split, fitted.theta)
    lacking = measure_latent_force(pulled[0].case, pulled[0].split, pulled[1].theta)
    assert quiet.force_n < 0.2 * lacking.force_n


def test_a_column_is_the_way_to_another_twin(pulled: tuple[Prepared, Fit]) -> None:
    """Gone along the column of the effect that is missing, the errors shrink as promised."""
    prepared, fitted = pulled
    case, split = prepared.case, prepared.split
    true = replace(fitted, theta=make_theta(TRUTH))
    latent = measure_latent_force(case, split, true.theta)
    whole = true.theta.copy()
    whole[SLOTS["rail_spring"]] = list(SPRING.values())
    system = linearise_predictions(case, split, true, latent, whole[None])
    step = system.gradient[-1] / system.normal[-1, -1]
    assert step == pytest.approx(1.0, abs=0.2)


def test_a_long_recording_is_filtered_in_groups(
    pulled: tuple[Prepared, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Groups of runs bound the memory, and change nothing."""
    prepared, fitted = pulled
    latent = measure_latent_force(prepared.case, prepared.split, fitted.theta)
    none = np.empty((0, fitted.theta.size))
    at_once = linearise_predictions(prepared.case, prepared.split, fitted, latent, none)
    monkeypatch.setattr(latent_force, "SAMPLES_AT_ONCE", 1000)
    grouped = linearise_predictions(prepared.case, prepared.split, fitted, latent, none)
    assert grouped.normal == pytest.approx(at_once.normal, rel=1e-9)
    assert grouped.gradient == pytest.approx(at_once.gradient, rel=1e-6)


def test_how_velocities_are_reported_changes_no_prediction(pulled: tuple[Prepared, Fit]) -> None:
    """Predictions begin at smoothed velocities, which are by the stamps, not as reported."""
    prepared, fitted = pulled
    filtered = fitted.theta.copy()
    filtered[SLOTS["velocity_filter"]] = 0.05
    run = range(0, 400)
    predictions = Predictions(prepared.case, [run], prepared.split.learn)
    gaps = predictions.run_steps(np.array([fitted.theta, filtered])).gaps
    np.testing.assert_array_equal(gaps[0], gaps[1])
    assert np.any(gaps[0] != 0.0)

"""A latent force takes what a twin lacks, and leaves constants and sizes near the truth."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.finding import sizes
from pendulum_sysid.finding.sizes import settle_sizes
from pendulum_sysid.fitting import latent_force
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.kalman_filter import SIZE, filter_motion
from pendulum_sysid.fitting.latent_force import fit_under_latent_force
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Fit
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import INERTIA, make_theta

FRICTION = "cart_coulomb_friction"
TRUTH = replace(INTECO, effects={FRICTION: {"level_n": 0.5}})
# What nobody asks for: a cable along the rail, and torque that grows with the square of the rate.
RUBS = {"rail_spring": {"n_per_m": 1.5, "centre_m": 0.25}, "pole_quadratic_drag": {"n_m_s2": 1e-4}}
RIG = replace(TRUTH, effects={**TRUTH.effects, **RUBS})
SAMPLES = 40


def prepare_made(truth: Twin, seed: int, amplitude: float = 0.1) -> tuple[Prepared, Fit]:
    """Return a recording of a rig, and the fit of the twin that knows the dry friction alone."""
    prepared = prepare([made(truth, seed=seed, amplitude=amplitude)], TRUTH)
    theta = make_theta(prepared.case.twin)
    for pieces in (4, 1):
        fitted = fit(prepared.case, prepared.split, (FRICTION,), theta, pieces)
        theta = fitted.theta
    return prepared, fitted


@pytest.fixture(scope="module")
def rubbed() -> tuple[Prepared, Fit, Fit]:
    """Return a rig that rubs, fitted by free runs and beside a latent force."""
    prepared, fitted = prepare_made(RIG, 3)
    return prepared, fitted, fit_under_latent_force(prepared.case, prepared.split, fitted)[0]


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


def test_sizes_are_nearer_to_the_truth_where_the_twin_lacks_something(
    rubbed: tuple[Prepared, Fit, Fit],
) -> None:
    """Free runs bend the pole's constants and the friction until they follow the cable."""
    _, free, settled = rubbed
    assert free.choose > 10.0
    true = {
        f"{FRICTION}.level_n": 0.5,
        "com_distance_m": RIG.rig.com_distance_m or 0.0,
        "pole_inertia_kg_m2": RIG.rig.pole_inertia_kg_m2 or 0.0,
    }
    for name, value in true.items():
        assert abs(settled.estimates[name].value / value - 1.0) < 0.02, name
        assert abs(free.estimates[name].value / value - 1.0) > 0.05, name
        assert settled.estimates[name].low <= value <= settled.estimates[name].high, name


def test_intervals_of_two_recordings_overlap(rubbed: tuple[Prepared, Fit, Fit]) -> None:
    """Another recording of the rig gets the same sizes, within intervals that are no wider."""
    prepared, free, settled = rubbed
    other, fitted = prepare_made(RIG, 4, 0.13)
    again = settle_sizes(other.case, other.split, fitted)
    for name, estimate in settle_sizes(prepared.case, prepared.split, free).estimates.items():
        assert estimate.low <= again.estimates[name].high
        assert again.estimates[name].low <= estimate.high
    widths = [
        (e.high - e.low) / (free.estimates[name].high - free.estimates[name].low)
        for name, e in settled.estimates.items()
    ]
    assert np.median(widths) < 1.0


def test_a_fit_at_the_noise_stays_as_it_is() -> None:
    """Where nothing is missing, free runs are the most that a recording says."""
    prepared, fitted = prepare_made(TRUTH, 6)
    assert fitted.choose < decisions.MISFIT_AT_NOISE
    assert settle_sizes(prepared.case, prepared.split, fitted) is fitted


def test_a_fit_whose_free_runs_are_surely_worse_is_not_taken(
    rubbed: tuple[Prepared, Fit, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sizes that make the improved twin run worse are no gain."""
    prepared, free, _ = rubbed
    settled, system = fit_under_latent_force(prepared.case, prepared.split, free)
    heavier = settled.theta.copy()
    heavier[INERTIA] *= 1.5
    worse = replace(settled, theta=heavier)
    monkeypatch.setattr(sizes, "fit_under_latent_force", lambda *_: (worse, system))
    kept = sizes.settle_sizes(prepared.case, prepared.split, free)
    assert np.array_equal(kept.theta, free.theta)


def test_a_perfect_twin_keeps_its_constants_beside_a_latent_force() -> None:
    """Where nothing is missing, the latent force is small and both fits agree."""
    prepared, fitted = prepare_made(TRUTH, 6)
    settled, _ = fit_under_latent_force(prepared.case, prepared.split, fitted)
    for name, estimate in fitted.estimates.items():
        assert settled.estimates[name].value == pytest.approx(estimate.value, rel=0.02), name


def test_a_long_recording_is_filtered_in_groups(
    rubbed: tuple[Prepared, Fit, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Groups of runs bound the memory, and change nothing."""
    prepared, free, settled = rubbed
    monkeypatch.setattr(latent_force, "SAMPLES_AT_ONCE", 1000)
    grouped, _ = fit_under_latent_force(prepared.case, prepared.split, free)
    for name, estimate in settled.estimates.items():
        assert grouped.estimates[name].value == pytest.approx(estimate.value, rel=1e-6), name

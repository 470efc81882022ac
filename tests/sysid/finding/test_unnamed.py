"""Intervals hold what physics without a name may have done to a fit."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.finding import replication
from pendulum_sysid.finding.replication import widen_intervals
from pendulum_sysid.finding.unnamed import compute_doubt, widen_sizes
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Fit, Split
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

FRICTION = "cart_coulomb_friction"
TRUTH = replace(INTECO, effects={FRICTION: {"level_n": 0.5}})
# What nobody asks for: a cable along the rail, and torque that grows with the square of the rate.
RUBS = {"rail_spring": {"n_per_m": 1.5, "centre_m": 0.25}, "pole_quadratic_drag": {"n_m_s2": 1e-4}}
RIG = replace(TRUTH, effects={**TRUTH.effects, **RUBS})
CONSTANTS, ERRORS, WINDOWS = 3, 60, 12


def make_system(columns: np.ndarray, errors: np.ndarray) -> System:
    """Return normal equations of linear errors, in windows."""
    by_window = zip(np.array_split(columns, WINDOWS), np.array_split(errors, WINDOWS), strict=True)
    parts = [(part.T @ part, part.T @ off) for part, off in by_window]
    normals, scores = map(np.array, zip(*parts, strict=True))
    none = np.empty((0, 0))
    return System(normals, scores, np.empty((0, 0, 0)), none, np.empty((0, 0, 0)), none[0:0], [])


def draw_errors(size: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return columns, each of length 1, their true sizes, and errors with unit noise."""
    random = np.random.default_rng(3)
    columns = random.normal(size=(ERRORS, CONSTANTS + 20))
    columns[:, CONSTANTS:] += columns[:, :1]  # the first constant looks like each of the effects
    columns /= np.linalg.norm(columns, axis=0)
    sizes = np.append(random.normal(size=CONSTANTS), size * random.normal(size=20))
    return columns, sizes, columns @ sizes + random.normal(size=ERRORS)


def prepare_made(truth: Twin, seed: int, amplitude: float = 0.1) -> tuple[Case, Split, Fit]:
    """Return a recording of a rig, and the fit of the twin that knows the dry friction alone."""
    prepared = prepare([made(truth, seed=seed, amplitude=amplitude)], TRUTH)
    theta = make_theta(prepared.case.twin)
    for pieces in (4, 1):
        fitted = fit(prepared.case, prepared.split, (FRICTION,), theta, pieces)
        theta = fitted.theta
    return prepared.case, prepared.split, fitted


@pytest.fixture(scope="module")
def rubbed() -> tuple[Case, Split, Fit]:
    return prepare_made(RIG, 3)


def test_the_doubt_is_that_of_the_joint_density() -> None:
    """Constants beside effects of a prior size: generalised least squares says the same."""
    columns, _, errors = draw_errors(10.0)
    doubt = compute_doubt(make_system(columns, errors), [f"effect {k}" for k in range(20)])
    known, effects = columns[:, :CONSTANTS], columns[:, CONSTANTS:]

    def spread_errors(variance: float) -> np.ndarray:
        return np.eye(ERRORS) + variance * effects @ effects.T

    def measure_likelihood(variance: float) -> float:
        """Return ln L of the errors, whatever the constants."""
        weight = np.linalg.inv(spread_errors(variance))
        inner = known.T @ weight @ known
        off = errors - known @ np.linalg.solve(inner, known.T @ weight @ errors)
        logs = [np.linalg.slogdet(matrix)[1] for matrix in (spread_errors(variance), inner)]
        return float(-0.5 * (off @ weight @ off + sum(logs)))

    variances = np.exp(np.linspace(0.0, 8.0, 801))
    variance = max(variances, key=measure_likelihood)
    weight = np.linalg.inv(spread_errors(variance))
    covariance = np.linalg.inv(known.T @ weight @ known)
    alone = np.linalg.inv(known.T @ known)
    assert doubt.shifts == pytest.approx(covariance @ known.T @ weight @ errors, rel=0.02)
    added = np.sqrt(np.diag(covariance - alone))
    assert doubt.deviations == pytest.approx(added, rel=0.02)


def test_effects_that_are_absent_cast_no_doubt() -> None:
    """Errors that are noise alone leave the intervals as they are."""
    columns, _, errors = draw_errors(0.0)
    doubt = compute_doubt(make_system(columns, errors), [f"effect {k}" for k in range(20)])
    alone = np.sqrt(np.diag(np.linalg.inv(columns[:, :CONSTANTS].T @ columns[:, :CONSTANTS])))
    assert np.all(doubt.deviations < 0.2 * alone)


def test_columns_of_one_effect_share_its_variance() -> None:
    """An effect that is tried at many places is believed no more for it."""
    columns, _, errors = draw_errors(10.0)
    again = np.column_stack([columns, *[columns[:, -1]] * 9])
    names = [f"effect {k}" for k in range(20)]
    plain = compute_doubt(make_system(columns, errors), names)
    repeated = compute_doubt(make_system(again, errors), [*names, *[names[-1]] * 9])
    assert repeated.deviations == pytest.approx(plain.deviations, rel=1e-6)


def hold(fitted: Fit, name: str, value: float) -> bool:
    return fitted.estimates[name].low <= value <= fitted.estimates[name].high


def test_an_interval_holds_the_truth_that_unnamed_physics_has_bent(
    rubbed: tuple[Case, Split, Fit], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The constants of the pole follow the cable, and the value of the fit stays as it is."""
    monkeypatch.setattr(replication, "DRAGS", ())  # which would hold the pole's friction, too
    monkeypatch.setattr(
        replication, "compute_spreads", lambda system, fit, free: np.zeros(len(free))
    )
    case, split, fitted = rubbed
    plain = widen_intervals(case, split, fitted)
    wide = widen_sizes(case, split, fitted)
    rig = RIG.rig
    true = {
        f"{FRICTION}.level_n": 0.5,
        "com_distance_m": rig.com_distance_m or 0.0,
        "pole_inertia_kg_m2": rig.pole_inertia_kg_m2 or 0.0,
        "pole_viscous_n_m_s": rig.pole_viscous_n_m_s or 0.0,
    }
    assert not all(hold(plain, name, value) for name, value in true.items())
    assert all(hold(wide, name, value) for name, value in true.items())
    for name, estimate in plain.estimates.items():
        wider = wide.estimates[name]
        assert wider.value == estimate.value, name
        assert wider.low <= estimate.low and estimate.high <= wider.high, name


def test_intervals_of_two_recordings_overlap(rubbed: tuple[Case, Split, Fit]) -> None:
    case, split, fitted = prepare_made(RIG, 4, 0.13)
    there = widen_sizes(case, split, fitted).estimates
    for name, here in widen_sizes(*rubbed).estimates.items():
        assert here.low <= there[name].high and there[name].low <= here.high, name


def test_the_size_of_a_name_is_that_which_it_has_if_it_is_right(
    rubbed: tuple[Case, Split, Fit],
) -> None:
    """Effects that cannot be told from a name cast no doubt on its size."""
    lookalikes = {"cart_load_friction", "cart_stribeck_friction", "cart_saturating_friction"}
    widths = []
    for alike in (set(), lookalikes):
        estimate = widen_sizes(*rubbed, alike).estimates[f"{FRICTION}.level_n"]
        widths.append(estimate.high - estimate.low)
    assert widths[1] < widths[0]


def test_a_fit_at_the_noise_stays_as_it_is(rubbed: tuple[Case, Split, Fit]) -> None:
    """Where nothing is missing, free runs are the most that a recording says."""
    case, split, fitted = prepare_made(TRUTH, 6)
    assert fitted.choose < decisions.MISFIT_AT_NOISE < rubbed[2].choose
    assert widen_sizes(case, split, fitted) is fitted


def test_errors_that_short_pieces_hide_in_the_noise_widen_intervals() -> None:
    """Over a quarter of a second the fit errs by 1.06 times the noise, over a second by more."""
    rest = {
        "rail_spring": {"n_per_m": 0.02, "centre_m": 0.05},
        "cogging": {"amplitude_n": 0.001, "period_m": 0.12, "phase_rad": 0.5},
    }
    recording, truth = record_hidden(rest, 4, 24.0)
    prepared = prepare([recording], INTECO)
    fitted = fit(prepared.case, prepared.split, (), make_theta(INTECO), 4)
    assert fitted.choose < decisions.MISFIT_AT_NOISE
    widened = widen_sizes(prepared.case, prepared.split, fitted)
    true = truth.rig.force_per_pwm_n
    before, after = (each.estimates["force_per_pwm_n"] for each in (fitted, widened))
    assert not before.low <= true <= before.high
    assert after.low <= true <= after.high and after.value == before.value


def test_a_fit_at_the_noise_over_whole_windows_keeps_its_intervals() -> None:
    recording, _ = record_hidden({}, 2, 24.0)
    prepared = prepare([recording], INTECO)
    fitted = fit(prepared.case, prepared.split, (), make_theta(INTECO), 4)
    assert widen_sizes(prepared.case, prepared.split, fitted) is fitted

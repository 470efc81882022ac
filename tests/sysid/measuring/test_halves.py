"""A law of one half of the time has to hold in the other half."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.made_fits import make_errors, make_fit
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.fitting.cross_validation import fit_without
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring import halves
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.halves import is_seen_in_halves
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law, spread_turn
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

RIG = Twin("rig", INTECO.rig)
TURN = spread_turn(24)
LAW = {"pole_torque_by_angle": Law(tuple(TURN), tuple(0.01 * np.sin(3.0 * TURN)))}


def measure_law(
    twins: list[Twin], effects: tuple[str, ...], name: str, amplitudes: tuple[float, ...] = ()
):
    """Return case, split, and fits with and without the law that recordings of twins show."""
    pushes = amplitudes or (0.25,) * len(twins)
    prepared = prepare(
        [made(twin, 16.0, amplitude) for twin, amplitude in zip(twins, pushes, strict=True)], RIG
    )
    case, split = prepared.case, prepared.split
    theta = make_theta(replace(RIG, effects={e: twins[0].effects[e] for e in effects}))
    begun = fit(case, split, effects, theta, HORIZONS[0])
    shorter = LawFit(begun, (), (), (), (), decisions.LAW_FIRST_INFLATION)
    (candidate,) = [r for r in rank_curves(case, split, shorter) if r.curve.kind.name == name]
    return case, split, fit_longer(case, split, shorter, candidate), shorter


@pytest.mark.parametrize(("laws", "holds"), [((LAW, LAW), True), ((LAW, {}), False)])
def test_a_law_that_only_one_half_shows_does_not_hold(laws, holds):
    twins = [replace(RIG, measured_laws=law) for law in laws]
    fits = measure_law(twins, (), "pole_torque_by_angle")
    assert is_seen_in_halves(*fits) is holds


@pytest.mark.parametrize(
    ("constant", "factor"), [("force_per_pwm_n", 1.15), ("com_distance_m", 1.05)]
)
def test_constants_that_differ_between_halves_hide_no_law(constant: str, factor: float):
    """What else is missing bends the constants of each half otherwise."""
    other = replace(RIG.rig, **{constant: factor * getattr(RIG.rig, constant)})
    weak = {"pole_torque_by_angle": Law(tuple(TURN), tuple(0.002 * np.sin(3.0 * TURN)))}
    twins = [replace(RIG, measured_laws=weak), replace(RIG, rig=other, measured_laws=weak)]
    assert is_seen_in_halves(*measure_law(twins, (), "pole_torque_by_angle"))


def test_one_half_is_not_asked_for_an_effect_of_the_time(monkeypatch):
    """Warming friction is over in the second half, which cannot tell it."""
    warming = {"friction_warming": {"level_n": 0.4, "viscous_n_s_m": 1.5, "time_constant_s": 2.0}}
    twin = replace(RIG, effects=warming, measured_laws=LAW)
    case, split, longer, shorter = measure_law(
        [twin], ("friction_warming",), "pole_torque_by_angle"
    )
    thetas = []

    def keep(*about):
        theta, starts = fit_without(*about)
        thetas.append(theta)
        return theta, starts

    monkeypatch.setattr(halves, "fit_without", keep)
    assert is_seen_in_halves(case, split, longer, shorter)
    own = SLOTS["friction_warming"]
    for theta, whole in zip(thetas, (longer,) * 4 + (shorter,) * 4, strict=True):
        np.testing.assert_array_equal(theta[own], whole.fit.theta[own])
        assert np.any(theta != whole.fit.theta)


@pytest.mark.parametrize("amplitudes", [(0.15, 0.3), (0.3, 0.2)])
def test_a_half_says_nothing_of_places_where_it_never_was(amplitudes: tuple[float, ...]):
    """The tape has a kink, and one half of the time stays nearer to the middle of the rail.

    Beyond, the law was drawn on by centimetres: the other half ran at 383 times the noise with it,
    and the kink was told as a wrong scale of the position.
    """
    at = tuple(np.linspace(-2.0, 2.0, 81))
    kink = {"position_error_along_rail": Law(at, tuple(-0.09 * np.maximum(at, -0.05)))}
    twin = replace(RIG, effects={"position_scale": {"ratio": -0.04}}, measured_laws=kink)
    fits = measure_law([twin, twin], ("position_scale",), "position_error_along_rail", amplitudes)
    assert is_seen_in_halves(*fits)


def test_laws_that_are_known_follow_in_each_half(monkeypatch):
    """A half is run with the other half's asked law, and with its own fit of the other laws."""
    gain = {"drive_gain_along_rail": Law((-1.0, 0.0, 1.0), (0.2, 0.0, -0.2))}
    twin = replace(RIG, measured_laws=LAW | gain)
    case, split, known, _ = measure_law([twin], (), "drive_gain_along_rail")
    (candidate,) = [
        r for r in rank_curves(case, split, known) if r.curve.kind.name == "pole_torque_by_angle"
    ]
    longer = fit_longer(case, split, known, candidate)
    fits = []

    def keep(system, whole, free, left_out, penalty):
        fits.append(({parameter.name.split(".")[0] for parameter in free}, left_out))
        return fit_without(system, whole, free, left_out, penalty)

    monkeypatch.setattr(halves, "fit_without", keep)
    assert is_seen_in_halves(case, split, longer, known)
    for other, own in (fits[:2], fits[2:4]):
        assert other[0] - own[0] == {"pole_torque_by_angle"} and "drive_gain_along_rail" in own[0]
        np.testing.assert_array_equal(own[1], ~other[1])


@pytest.mark.parametrize(("loss", "holds"), [(0.0, True), (0.1, False)])
def test_a_law_that_surely_spoils_a_half_does_not_hold(monkeypatch, loss: float, holds: bool):
    """However much the other half gains by it."""
    off, late = make_errors(3, windows=24), np.random.default_rng(1).normal(loss, 0.1, 12)
    factors = np.concatenate([np.full(12, 0.3), np.exp(late)])[:, None]
    longer, shorter = SimpleNamespace(curves=("asked",)), SimpleNamespace(curves=())
    runs = [make_fit(off * factors), make_fit(off)]
    monkeypatch.setattr(halves, "_run_halves", lambda *about: runs.pop(0))
    assert is_seen_in_halves(None, None, longer, shorter) is holds


@pytest.mark.parametrize(("gains", "errors"), [([3.0], 0.0), ([1.0, 3.0], 2.0)])
def test_a_window_alone_has_no_standard_error(gains, errors):
    assert halves._measure_in_errors(np.array(gains)) == pytest.approx(errors)

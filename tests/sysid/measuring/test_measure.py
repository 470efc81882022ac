"""Inject a law without a name, and measure it: kind, values, band, and what it does elsewhere."""

import functools
import itertools
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S, made, made_states, sweep

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.finding.localisation.balance import compute_motion
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_own_parameters
from pendulum_sysid.fitting.gauss_newton import compute_power
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.measuring import curve as curve_module
from pendulum_sysid.measuring import measure as measure_module
from pendulum_sysid.measuring import names_beside_laws as names_module
from pendulum_sysid.measuring.curve import Curve, list_curves
from pendulum_sysid.measuring.formula_fit import ShapeParameter
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.law_bands import widen_bands
from pendulum_sysid.measuring.measure import (
    begin_without_laws,
    fit_without_laws,
    measure_laws,
)
from pendulum_sysid.measuring.names_beside_laws import (
    is_part_of_law,
    leave_out_names,
    list_bent,
    list_lesser_parts,
    list_needed,
    list_sized,
    list_stand_ins,
)
from pendulum_sysid.measuring.naming import (
    NamedCurve,
    is_certain,
)
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.measuring.shape_fit import FittedShape
from pendulum_sysid.measuring.shapes import SHAPES
from pendulum_sysid.measuring.shared_parameters import list_shared_parameters
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_sysid.telling.law_text import write_formula, write_sentence
from pendulum_twin.laws import BY_NAME
from pendulum_twin.laws.kind import LIMITS, Role
from pendulum_twin.laws.law import Law, evaluate_law, spread_turn
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import LAWS as LAWS_BEGIN
from pendulum_twin.parameter_vector import VALUES, list_law_kinds, make_theta

RIG = Twin("rig", INTECO.rig)
HELD = hold_constants(RIG, ("all",))
AT = np.linspace(-1.8, 1.8, 61)
CLOCK = np.linspace(0.0, 30.0, 31)
LAWS = {
    "cart_force_by_position": Law(tuple(AT), tuple(-3.0 * AT**3)),
    "drive_gain_along_rail": Law(tuple(AT), tuple(np.tanh(0.4 * AT))),
    "cart_drag_by_pole_rate": Law(tuple(10.0 * AT), tuple(4.0 * np.abs(AT))),
    "cart_dry_friction_by_velocity": Law(tuple(AT), tuple(0.5 + 1.5 * np.exp(-((AT / 0.4) ** 2)))),
    "cart_one_way_drag_along_rail": Law(tuple(AT), tuple(-0.8 * np.tanh(3.0 * AT))),
    "pole_torque_by_angle": Law(tuple(spread_turn(24)), tuple(0.01 * np.sin(3 * spread_turn(24)))),
    "clock_pace_over_time": Law(tuple(CLOCK), tuple(0.1 * np.sin(2 * np.pi * CLOCK / 10.0))),
}


DRAG = "cart_drag_by_pole_rate"


def prepare_with(laws, seconds=30.0):
    recording = made(replace(RIG, measured_laws=laws), seconds, amplitude=0.25)
    prepared = prepare([recording], RIG)
    return prepared.case, prepared.split


def fit_names_alone(recording, effects):
    """Return a fit of a recording with these effects as names, and without laws."""
    prepared = prepare([recording], RIG)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(RIG, effects=effects))
    named = fit(case, split, tuple(effects), start, HORIZONS[0])
    return measure_module.Measured(case, split, begin_without_laws(case, split, named))


@functools.cache
def measure_alone(name):
    """Return a fit without the law of this name, and the law as it is measured."""
    case, split = prepare_with({name: LAWS[name]})
    start = fit_own_parameters(case, split)
    begin = begin_without_laws(case, split, start)
    return start, measure_laws(case, split, begin, lambda line: None)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_measured_where_it_is(name):
    start, held = measure_alone(name)
    assert held is not None and [curve.kind.name for curve in held.law_fit.curves] == [name]
    final, (named,) = held.named
    assert final.choose < 1.5 < 3.0 < start.choose
    curve, kind = named.curve, BY_NAME[name]
    truth = evaluate_law(kind, LAWS[name], curve.knots)
    own = held.law_fit.curves[0]
    if own.others:  # a constant of the rig takes the mean
        (mean,) = own.gauges @ evaluate_law(kind, LAWS[name], own.knots)
        truth = (1.0 + truth) / (1.0 + mean) - 1.0 if kind.role is Role.GAIN else truth - mean
    seen = (curve.knots >= own.knots[0]) & (curve.knots <= own.knots[-1])
    off = np.abs(named.values - truth)[seen]
    assert np.median(off) < 0.03 * np.ptp(truth[seen])
    command = sweep(8.0, 0.2)[::-1].copy()
    run, told, without = (
        made_states(twin, command)
        for twin in (replace(RIG, measured_laws={name: LAWS[name]}), final.twin, start.twin)
    )
    assert np.std((run - told)[:300, 0]) < 0.3 * np.std((run - without)[:300, 0])


SHARED = {
    "drive_gain_along_rail": ("force_per_pwm_n",),
    "cart_drag_by_pole_rate": ("cart_viscous_n_s_m",),
    "cart_dry_friction_by_velocity": ("force_per_pwm_n", "cart_viscous_n_s_m"),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_law_shares_the_constant_of_which_it_can_hold_a_part(name):
    measured = measure_alone(name)[1]
    shared = list_shared_parameters(measured.case, measured.law_fit)
    assert shared == SHARED.get(name, ())
    alone = replace(measured.law_fit, curves=())
    assert list_shared_parameters(measured.case, alone) == ()


def test_a_gain_over_a_turn_of_the_shaft_is_measured_and_holds_at_other_places():
    """A motor ripples several times a turn, at places beyond those of the recording, too."""
    turn_m, step_m = 57e-6 * 4096, 57e-6
    knots = spread_turn(64, turn_m)
    phase = 2 * np.pi * knots / turn_m
    values = 0.06 * np.sin(phase) + 0.08 * np.sin(4 * phase + 1.0) + 0.05 * np.cos(8 * phase)
    law = {"drive_gain_over_shaft_turn": Law(tuple(knots), tuple(values))}
    recording = made(replace(RIG, measured_laws=law), 30.0, amplitude=0.25, noise=0.0)
    signals = recording.signals
    cart = np.rint(signals.cart / step_m) * step_m
    pole = np.rint(signals.pole * 4096 / (2 * np.pi)) * (2 * np.pi / 4096)
    prepared = prepare([replace(recording, signals=replace(signals, cart=cart, pole=pole))], RIG)
    case, split = prepared.case, prepared.split
    start = fit_own_parameters(case, split)
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert held is not None and [curve.kind.name for curve in held.law_fit.curves] == [*law]
    final, (named,) = held.named
    assert final.choose < 1.5 < 3.0 < start.choose
    off = named.values - evaluate_law(
        named.curve.kind, law[named.curve.kind.name], named.curve.knots
    )
    assert np.std(off) < 0.15 * np.std(values)
    assert write_sentence(named).endswith("no formula was tried.")
    elsewhere = made_states(replace(RIG, measured_laws=law), sweep(8.0, 0.2)[::-1].copy())
    told, without = (
        made_states(twin, sweep(8.0, 0.2)[::-1].copy()) for twin in (final.twin, start.twin)
    )
    assert np.std((elsewhere - told)[:300, 0]) < 0.3 * np.std((elsewhere - without)[:300, 0])


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("cart_hysteresis", Law((0.02, 0.04, 0.08), (0.0, 0.3, 0.0))),
        ("pole_hysteresis", Law((0.2, 0.4, 0.8), (0.0, 0.004, 0.003))),
    ],
)
def test_a_friction_that_remembers_its_way_is_measured(name, law):
    case, split = prepare_with({name: law})
    start = fit_own_parameters(case, split)
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert [curve.kind.name for curve in held.law_fit.curves] == [name]
    final, (named,) = held.named
    assert final.choose < 1.5 < 10.0 < start.choose
    assert np.sum(named.values) == pytest.approx(np.sum(law.values), rel=0.05)
    middle = np.sum(named.values * named.curve.knots) / np.sum(named.values)
    assert middle == pytest.approx(np.average(law.knots, weights=law.values), rel=0.1)
    assert named.shape is None and "slips from" in write_sentence(named)


def test_a_joint_that_hardly_moves_shows_no_hysteresis(monkeypatch):
    case, _ = prepare_with({}, 8.0)
    here = compute_motion(case, make_theta(RIG))
    still = replace(here, x=1e-9 * here.x)
    monkeypatch.setattr(curve_module, "compute_motion", lambda case, theta: still)
    names = {curve.kind.name for curve in list_curves(case, make_theta(RIG), ())}
    assert "cart_hysteresis" not in names and "pole_hysteresis" in names


def test_an_effect_is_needed_beside_a_law_that_cannot_stand_for_it(monkeypatch):
    twin = replace(
        RIG,
        effects={"rail_spring": {"n_per_m": 1.5, "centre_m": 0.05}},
        measured_laws={"cart_drag_by_pole_rate": LAWS["cart_drag_by_pole_rate"]},
    )
    prepared = prepare([made(twin, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    start = fit(case, split, ("rail_spring",), make_theta(replace(twin, measured_laws={})))
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert [curve.kind.name for curve in held.law_fit.curves] == ["cart_drag_by_pole_rate"]
    assert list_sized(held, ["rail_spring", "cart_sign_inverted"]) == ["rail_spring"]
    without = leave_out_names(held, ["rail_spring"])
    assert list_needed(held, without) == ("rail_spring",)
    monkeypatch.setattr(names_module, "_is_much_left", lambda *fits: True)
    monkeypatch.setattr(decisions, "LAW_LEAST_NATS", 0.0)  # laws are tried, though little is left
    assert list_stand_ins(held, without) == []


def test_an_effect_gives_way_to_the_law_that_it_stands_for():
    """Magnets that hold the pole, and a disc off its axis that is named for them."""
    disc, turn = {"eccentric_encoder": {"sine_rad": 0.02, "cosine_rad": -0.02}}, spread_turn(24)
    magnets = Law(tuple(turn), tuple(0.004 * np.cos(turn) ** 2))
    truth = replace(RIG, measured_laws={"pole_torque_by_angle": magnets})
    held = fit_names_alone(made(truth, 20.0, amplitude=0.3), disc)
    without = leave_out_names(held, ["eccentric_encoder"])
    assert list_stand_ins(held, without) == ["eccentric_encoder"]


def test_a_law_that_bends_between_its_knots_gets_more_knots():
    turn = spread_turn(60)
    ripple = Law(tuple(turn), tuple(0.01 * np.sin(9.0 * turn)))
    case, split = prepare_with({"pole_torque_by_angle": ripple})
    held = measure_laws(
        case,
        split,
        begin_without_laws(case, split, fit_own_parameters(case, split)),
        lambda line: None,
    )
    (curve,) = held.law_fit.curves
    assert curve.kind.name == "pole_torque_by_angle"
    assert len(curve.knots) > decisions.LAW_KNOTS
    assert held.law_fit.fit.choose < 2.0


def test_a_formula_stays_within_the_limits_of_its_law():
    kind = BY_NAME["angle_error_over_turn"]
    (constant,) = [s for s in SHAPES if s.name == "constant"]
    theta = make_theta(
        replace(RIG, measured_laws={kind.name: Law(tuple(spread_turn(8)), (0.0,) * 8)})
    )
    at = LAWS_BEGIN + VALUES
    knots = tuple(spread_turn(8))
    own = ShapeParameter(
        "offset", constant, knots, at, 0, 1.0, -LIMITS[kind.role], LIMITS[kind.role]
    )
    own.put(theta, 7.0)
    assert np.all(theta[at : at + 8] == np.pi)


def test_friction_below_none_is_said_to_be_none():
    kind = BY_NAME["cart_dry_friction_along_rail"]
    knots = np.linspace(-0.1, 0.1, 5)
    (step,) = [shape for shape in SHAPES if shape.edge]
    for before, says in ((-7.4, True), (0.0, False)):
        sizes = np.array([before, 0.6, 0.0, 0.001])
        values = step.draw_columns(knots, sizes[2:]) @ sizes[:2]
        curve = Curve(kind, knots, knots, 1.0, -10.0)
        fitted = FittedShape(step, sizes, np.full(4, 0.1), values, 1.0)
        told = write_sentence(NamedCurve(curve, values, np.zeros(5), 4.0, fitted))
        assert told.endswith("together is below 0, there is none.") == says
        told = write_sentence(NamedCurve(curve, values, np.zeros(5), 4.0, None))
        assert told.endswith("together is below 0, there is none.") == says


def test_friction_of_one_half_of_the_rail_has_a_sharp_edge():
    """Its curve is smooth over centimetres; the knots of its formula lie about the edge."""
    along = np.linspace(0.02, 0.06, 120)
    half = Law(tuple(along), tuple(np.where(along > 0.0431, 1.0, 0.0)))
    case, split = prepare_with({"cart_dry_friction_along_rail": half})
    start = fit_own_parameters(case, split)
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    final, (named,) = held.named
    assert named.shape is not None and named.shape.shape.name == "step"
    sizes = dict(zip(named.shape.names, named.shape.values, strict=True))
    assert sizes["before"] == pytest.approx(0.0, abs=0.02)
    assert sizes["behind"] == pytest.approx(1.0, abs=0.02)
    assert sizes["place"] == pytest.approx(0.0431, abs=1e-3)
    assert final.choose < 1.2 < 2.0 < held.law_fit.fit.choose
    assert "N behind it." in write_sentence(named)


def test_a_formula_that_is_worse_than_its_curve_is_not_told():
    """A magnet near one angle: on short windows a wave of a turn comes near the noise."""
    turn = spread_turn(120)
    away = (np.mod(turn - 2.9 + np.pi, 2 * np.pi) - np.pi) / 0.5
    magnet = Law(tuple(turn), tuple(-0.009 * away * np.exp(-away * away)))
    case, split = prepare_with({"pole_torque_by_angle": magnet})
    start = fit_own_parameters(case, split)
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    final, (named,) = held.named
    assert named.curve.kind.name == "pole_torque_by_angle" and named.shape is None
    assert final.choose < 1.2


def test_a_formula_takes_the_place_of_its_curve():
    _, held = measure_alone("cart_force_by_position")
    final, (named,) = held.named
    assert named.shape is not None and named.shape.shape.name in ("cube", "line and cube")
    sizes = dict(zip(named.shape.names, named.shape.values, strict=True))
    assert sizes["factor"] == pytest.approx(-3.0, rel=0.15)
    assert final.choose < 1.2
    assert "x^3" in write_formula(named) and "force on the cart in N" in write_formula(named)


def test_a_law_beside_an_encoder_slip_keeps_the_time_of_the_slip():
    slip = {"encoder_slip": {"angle_rad": 0.2, "time_s": 14.995}}
    laws = {"cart_force_by_position": LAWS["cart_force_by_position"]}
    recording = made(replace(RIG, measured_laws=laws, effects=slip), 30.0, amplitude=0.25)
    prepared = prepare([recording], RIG)
    case, split = prepared.case, prepared.split
    theta = make_theta(replace(RIG, effects=slip))
    start = fit(case, split, tuple(slip), theta, HORIZONS[0])
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    named, _ = held.named
    for result in (held.law_fit.fit, named):
        assert result.estimates["encoder_slip.time_s"].value == pytest.approx(14.995, abs=1e-6)
        assert result.estimates["encoder_slip.angle_rad"].value == pytest.approx(0.2, abs=0.002)


def test_a_formula_that_the_recording_does_not_fix_is_none():
    """A bump narrower than a knot's distance may be as high as it likes."""
    law = Law(tuple(AT), tuple(0.15 * np.sin(2 * np.pi * AT / 0.6)))
    case, split = prepare_with({"drive_gain_along_rail": law})
    held = measure_laws(
        case,
        split,
        begin_without_laws(case, split, fit_own_parameters(case, split)),
        lambda line: None,
    )
    final, (named,) = held.named
    force = final.estimates["force_per_pwm_n"]
    assert force.identifiable and force.high - force.low < 0.02 * force.value
    if named.shape is not None:
        sure = np.abs(named.shape.values) > 1.96 * named.shape.deviations
        assert sure[1 : len(named.shape.shape.factors)].any()


def test_laws_begin_over_whole_windows_where_short_windows_show_nothing():
    """A fit without a law is compared with fits over the same horizon."""
    case, split = prepare_with({})
    start = fit_own_parameters(case, split)
    begun = begin_without_laws(case, split, start)
    assert begun.fit.pieces == HORIZONS[-1]
    wrong = replace(start, theta=make_theta(RIG), effects=())
    longer = fit_without_laws(case, split, wrong, HORIZONS[0])
    assert longer.fit.pieces == HORIZONS[0]
    case, split = prepare_with({"cart_force_by_position": LAWS["cart_force_by_position"]})
    far = begin_without_laws(case, split, fit_own_parameters(case, split))
    assert far.fit.pieces == HORIZONS[0] and far.fit.choose > 1.1


def test_a_formula_of_which_nothing_fixes_a_parameter_is_none():
    (shape,) = [s for s in SHAPES if s.name == "square"]
    sizes = np.ones(len(shape.factors) + len(shape.more))
    sure = FittedShape(shape, sizes, 0.1 * sizes, np.zeros(4), 1.0)
    assert is_certain(sure)
    assert not is_certain(replace(sure, deviations=np.array([np.inf, *sure.deviations[1:]])))


WANDERING = 0.15 * np.random.default_rng(5).standard_normal(31)
RECOVERING = -0.3 * np.exp(-CLOCK / 8.0)
SWINGING = 0.2 * np.sin(2 * np.pi * CLOCK / 6.0)


@pytest.mark.parametrize(
    ("gain", "shape"),
    [
        (RECOVERING, "exponential"),
        (RECOVERING + SWINGING, "exponential and wave"),
        (WANDERING, None),
    ],
    ids=["back", "back_and_swings", "wanders"],
)
def test_a_curve_over_time_needs_a_formula_to_be_of_the_rig(gain, shape):
    """A drive that recovers may do so again; the wandering of a minute is not that of the next."""
    case, split = prepare_with({"drive_gain_over_time": Law(tuple(CLOCK), tuple(gain))})
    start = fit_own_parameters(case, split)
    ranked = rank_curves(case, split, LawFit(start, (), (), (), (), 4.0))
    assert ranked[0].curve.kind.name == "drive_gain_over_time"
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    laws = held.named[1] if held is not None else ()
    over_time = [n for n in laws if n.curve.kind.name == "drive_gain_over_time"]
    assert [n.shape and n.shape.shape.name for n in over_time] == ([shape] if shape else [])


def test_a_curve_over_time_waits_for_its_formula_until_other_laws_are_measured():
    """Friction that remembers its way clouds the wave of the drive."""
    clock = np.linspace(0.0, 30.0, 121)
    laws = {
        "drive_gain_over_time": Law(tuple(clock), tuple(0.03 * np.sin(2 * np.pi * clock / 8.3))),
        "cart_one_way_drag_along_rail": Law(tuple(AT), tuple(-0.2 * np.tanh(50.0 * AT))),
        "cart_hysteresis": Law((0.06, 0.12, 0.24), (0.02, 0.02, 0.02)),
    }
    case, split = prepare_with(laws)
    start = fit_own_parameters(case, split)
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert held is not None and set(held.kinds) == set(laws)
    final, named = held.named
    assert final.choose < 1.5 < 50.0 < start.choose
    (wave,) = [law.shape for law in named if law.curve.kind.name == "drive_gain_over_time"]
    assert wave is not None and wave.shape.name == "wave"
    assert wave.values[wave.names.index("period")] == pytest.approx(8.3, abs=0.05)


@dataclass(frozen=True)
class Scripted:
    """Stand for a fit with laws: their kinds, which have formulas, and the evidence for them."""

    kinds: tuple[str, ...]
    formulas: tuple[bool, ...]
    choose: float
    nats: tuple[float, ...] | None = None
    is_complete: bool = False

    @property
    def is_at_noise(self):
        return self.choose <= decisions.MISFIT_AT_NOISE

    @property
    def law_fit(self):
        curves = tuple(SimpleNamespace(kind=BY_NAME[kind]) for kind in self.kinds)
        nats = self.nats or (100.0,) * len(curves)
        priors = tuple(SimpleNamespace(evidence=value) for value in nats)
        fit = SimpleNamespace(choose=self.choose, theta=self.kinds)
        return SimpleNamespace(curves=curves, priors=priors, fit=fit)

    @property
    def named(self):
        return None, tuple(SimpleNamespace(shape=formula or None) for formula in self.formulas)


@pytest.mark.parametrize("helps", [True, False])
@pytest.mark.parametrize("comes", [True, False])
def test_a_curve_over_time_waits_until_its_formula_comes(comes, helps, monkeypatch):
    """No later law takes a formula away; without a formula the curve goes, and others may stay."""
    gain, drag = "drive_gain_over_time", "cart_drag_along_rail"
    waits = []

    def add(measured, report, most_waiting):
        waits.append(most_waiting)
        if most_waiting == 1 and not measured.kinds:
            return Scripted((gain,), (False,), 20.0)
        if measured.kinds == (gain,):
            return Scripted((gain, drag), (comes, False), 2.0)
        return None

    stand_ins = {
        "Measured": lambda *_: Scripted((), (), 40.0),
        "_add_law": add,
        "leave_curves_out": lambda measured, which: Scripted((drag,), (False,), 9.0),
        "_list_idle_over_time": lambda measured: [0] * (not comes),
        "compute_lead": lambda rich, simple: SimpleNamespace(is_real=helps),
        "is_seen_in_halves": lambda *about: True,
        "list_law_kinds": lambda kinds: kinds,
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(measure_module, name, stand_in)
    begun = SimpleNamespace(fit=None)
    held = measure_laws(None, None, begun, lambda line: None)
    assert waits == ([1, 1, 0] if comes else [1, 1, 1, 0])
    if comes:
        assert held.kinds == (gain, drag)
    else:
        assert held.kinds == (drag,) if helps else held is None


SMALL = ("cart_drag_along_rail", "cart_one_way_drag_along_rail", "drive_gain_by_velocity")


@pytest.mark.parametrize(
    ("misfits", "kept"),
    [
        ((4.0, 3.3, 2.5, 1.0), 4), ((4.0, 3.3, 0.9), 3), ((4.0, 3.3, 2.5, 2.2), 1),
        ((4.0, 3.3), 1), ((4.0,), 1), ((1.21, 1.19), 1),
    ],
    ids=["together", "earlier", "much left", "no further law", "no law", "little together"],
)  # fmt: skip
def test_laws_of_small_leads_stay_where_they_end_at_the_noise(monkeypatch, misfits, kept):
    """Five small causes: the first law alone stood out, and its twin erred by 7 floors elsewhere.

    With the four others it errs by 1.06. Above the noise a small lead says nothing. A law that
    took half of a free swing from 0.74 to 0.59 mrad took the other half from 0.63 to 1.07.
    """
    chain = [Scripted(("pole_drag_by_angle",), (False,), misfits[0])]
    for kind, misfit in zip(SMALL, misfits[1:], strict=False):
        chain.append(Scripted((*chain[-1].kinds, kind), (False,), misfit))
    longer = {a.kinds: b for a, b in itertools.pairwise(chain)}

    def add(measured, report, most_waiting, small):
        assert small and most_waiting == 0
        return longer.get(measured.kinds)

    monkeypatch.setattr(measure_module, "_add_law", add)
    monkeypatch.setattr(measure_module, "list_law_kinds", lambda kinds: kinds)
    monkeypatch.setattr(
        measure_module,
        "compute_lead",
        lambda rich, simple: SimpleNamespace(is_real=simple.choose > 1.1 * rich.choose),
    )
    held = measure_module.add_small_laws(chain[0], lambda line: None)
    assert len(held.kinds) == kept


def test_a_law_that_a_later_law_makes_needless_goes(monkeypatch):
    """A drag of the pole stood for the error of a disc, and was told as a drag of 1e-9 N m s."""
    drag, disc, gain = "pole_one_way_drag_by_angle", "angle_error_over_turn", "command_curve"
    longer = {
        (): Scripted((drag,), (False,), 20.0),
        (drag,): Scripted((drag, disc), (False, False), 3.0, nats=(-0.1, 19.0)),
        (disc,): Scripted((disc, gain), (False, False), 2.0, nats=(12.0, 5.0)),
    }
    stand_ins = {
        "_add_law": lambda measured, *about: longer.get(measured.kinds),
        "leave_curves_out": lambda measured, which: Scripted(
            tuple(k for n, k in enumerate(measured.kinds) if n not in which), (False,), 3.0
        ),
        "_is_of_rig": lambda measured: False,
        "list_law_kinds": lambda kinds: kinds,
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(measure_module, name, stand_in)
    held = measure_module._add_laws(Scripted((), (), 40.0), lambda line: None, np.inf, 0)
    assert held.kinds == (disc, gain)


def test_the_only_law_of_a_rig_whose_constants_are_held_can_go():
    laws = {DRAG: LAWS[DRAG]}
    prepared = prepare([made(replace(RIG, measured_laws=laws), 12.0, 0.25)], HELD)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    held = measure_laws(case, split, begun, lambda line: None)
    assert held is not None and DRAG in held.kinds
    less = measure_module.leave_curves_out(held, range(len(held.kinds)))
    assert less.kinds == () and less.law_fit.fit.choose == pytest.approx(
        begun.fit.choose, rel=1e-3
    )


def test_a_curve_over_time_that_other_laws_can_do_without_is_not_needed(monkeypatch):
    drag, gain = "cart_drag_by_pole_rate", "drive_gain_over_time"
    case, split = prepare_with({drag: LAWS[drag]}, 20.0)
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    measured = measure_laws(case, split, begun, lambda line: None)
    assert measured is not None and measured.kinds == (drag,)
    monkeypatch.setattr(decisions, "LAW_LEAST_NATS", -np.inf)
    likely = {r.curve.kind.name: r for r in rank_curves(case, split, measured.law_fit)}
    longer = fit_longer(case, split, measured.law_fit, likely[gain])
    idle = replace(measured, law_fit=longer)
    assert idle.kinds == (drag, gain)
    without = measure_module.leave_curves_out(idle, [1])
    assert without.kinds == (drag,)
    assert [kind.name for kind in list_law_kinds(without.law_fit.fit.theta)] == [drag]
    assert not compute_lead(idle.law_fit.fit, without.law_fit.fit).is_real
    assert measure_module._list_idle_over_time(idle) == [1]


def test_a_law_for_which_an_effect_stood_is_fitted_however_many_are_likelier(monkeypatch):
    """Friction on half of the rail: far off, four other laws of friction looked likelier."""
    kinds = [*LAWS][:6]
    ranked = [
        SimpleNamespace(
            curve=SimpleNamespace(kind=BY_NAME[kind]), prior=SimpleNamespace(evidence=100.0 - k)
        )
        for k, kind in enumerate(kinds)
    ]
    fitted = []

    def begin(case, split, law_fit, candidate):
        fitted.append(candidate.curve.kind.name)
        return SimpleNamespace(fit=SimpleNamespace(choose=9.0))

    monkeypatch.setattr(decisions, "LAWS_REFITTED", 2)
    monkeypatch.setattr(measure_module, "rank_curves", lambda *about: ranked)
    monkeypatch.setattr(measure_module, "begin_longer", begin)
    monkeypatch.setattr(measure_module, "_take_best", lambda *about: None)
    law_fit = SimpleNamespace(fit=SimpleNamespace(choose=40.0))
    start = measure_module.Measured(None, None, law_fit, frozenset({kinds[4]}))
    measure_module._add_law(start, lambda line: None, 0)
    assert fitted == [kinds[0], kinds[1], kinds[4]]


def test_nothing_is_measured_where_nothing_is_missing():
    case, split = prepare_with({})
    start = fit_own_parameters(case, split)
    assert (
        measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
        is None
    )
    ranked = rank_curves(case, split, LawFit(start, (), (), (), (), 4.0))
    assert len(ranked) <= 2


def test_a_law_that_the_given_twin_has_is_not_measured_again(monkeypatch):
    monkeypatch.setattr(decisions, "LAW_LEAST_NATS", -np.inf)
    knots = (-0.5, 0.5)
    given = {"cart_force_by_position": Law(knots, (0.4, -0.4))}
    recording = made(replace(INTECO, measured_laws=given), 12.0, 0.2)
    twin = replace(INTECO, measured_laws={**given, "cart_drag_along_rail": Law(knots, (0.1, 0.1))})
    prepared = prepare([recording], twin)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    kinds = {ranked.curve.kind.name for ranked in rank_curves(case, split, begun)}
    assert kinds and kinds.isdisjoint(twin.measured_laws)


def test_a_twin_that_is_full_of_laws_gets_no_more(monkeypatch):
    """One slot stays for the questions to the names; a seventh law of the given twin takes it."""
    monkeypatch.setattr(decisions, "LAW_LEAST_NATS", -np.inf)
    knots = (-0.5, 0.5)
    names = (
        "cart_drag_along_rail", "cart_force_by_position", "pole_torque_by_position",
        "drive_gain_along_rail", "drive_gain_by_velocity", "cart_one_way_drag_along_rail",
        "cart_drag_by_pole_rate",
    )  # fmt: skip
    recording = made(INTECO, 12.0, 0.2)
    for count in (7, 6):
        full = {name: Law(knots, (1e-3, 1e-3)) for name in names[:count]}
        prepared = prepare([recording], replace(INTECO, measured_laws=full))
        case, split = prepared.case, prepared.split
        begun = begin_without_laws(case, split, fit_own_parameters(case, split))
        assert bool(rank_curves(case, split, begun)) is (count == 6)
        assert measure_laws(case, split, begun, lambda line: None) is None


@pytest.mark.parametrize(("sine_rad", "lesser"), [(0.06, []), (0.002, ["eccentric_encoder"])])
def test_a_wave_of_a_turn_is_a_name_where_it_is_most_of_the_error(sine_rad, lesser):
    turn = spread_turn(24)
    second = {"angle_error_over_turn": Law(tuple(turn), tuple(0.02 * np.sin(2 * turn)))}
    disc = {"eccentric_encoder": {"sine_rad": sine_rad, "cosine_rad": 0.0}}
    truth = replace(RIG, effects=disc, measured_laws=second)
    prepared = prepare([made(truth, 20.0, amplitude=0.3)], RIG)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(RIG, effects=disc))
    begun = begin_without_laws(
        case, split, fit(case, split, ("eccentric_encoder",), start, HORIZONS[0])
    )
    held = measure_laws(case, split, begun, lambda line: None)
    assert held is not None
    assert [curve.kind.name for curve in held.law_fit.curves] == ["angle_error_over_turn"]
    told = held.law_fit.fit.estimates["eccentric_encoder.sine_rad"].value
    assert told == pytest.approx(sine_rad, abs=0.002)
    assert list_lesser_parts(held, ["eccentric_encoder"]) == lesser
    unmeasured = replace(held, law_fit=begun)
    assert list_stand_ins(unmeasured, leave_out_names(unmeasured, ["eccentric_encoder"])) == lesser
    assert is_part_of_law(held, "eccentric_encoder")
    assert not is_part_of_law(held, "cart_coulomb_friction")


KINKED, BENT, TOOTHED = (
    (lambda x: 0.06 * np.maximum(x - 0.02, 0.0)),
    (lambda x: 0.05 * x + 0.06 * x * abs(x)),
    (lambda x: 0.04 * x + 0.0006 * np.sin(2 * np.pi * x / 0.1)),
)


@pytest.mark.parametrize(
    ("error", "lesser"), [(KINKED, ["position_scale"]), (BENT, []), (TOOTHED, [])]
)
@pytest.mark.parametrize("often", [1, 30])
def test_a_scale_that_half_of_the_rail_lacks_is_no_scale(error, lesser, often):
    """A tape with a joint was named as a scale of 0.04: it has none, and 0.06 behind the joint.

    often: how many times as often the cart is behind the joint; another tape was named for that.
    """
    kind, knots = BY_NAME["position_error_along_rail"], np.linspace(-0.35, 0.35, 64)
    seen = np.concatenate([knots, np.repeat(knots[knots > 0.0], often - 1)])
    curve = Curve(kind, knots, seen, 0.01, -1.0, ("mean",), ("slope",))
    scale, level = np.polyfit(seen, error(seen), 1)
    theta = make_theta(replace(RIG, effects={"position_scale": {"ratio": scale}}))
    curve.put(theta, error(knots) - scale * knots - level)
    law_fit = SimpleNamespace(curves=(curve,), fit=SimpleNamespace(theta=theta))
    assert list_lesser_parts(SimpleNamespace(law_fit=law_fit), ["position_scale"]) == lesser


@pytest.mark.parametrize("recovers", [True, False])
def test_a_name_keeps_its_shape_beside_a_law_of_its_kind_that_was_not_measured(recovers):
    """Both recordings of a battery that recovers named a drift; four other laws were measured.

    A drift is a drift beside a drag that was not measured, whatever a curve over time follows.
    """
    drift, clock, drag = {"gain_drift": {"per_s": 0.003}}, np.linspace(0, 30, 31), LAWS[DRAG]
    battery = {"drive_gain_over_time": Law(tuple(clock), tuple(-0.12 * np.exp(-clock / 9.0)))}
    small = {DRAG: replace(drag, values=tuple(0.1 * np.array(drag.values)))}
    truth = replace(RIG, measured_laws=battery if recovers else small)
    truth = truth if recovers else replace(truth, effects=drift)
    measured = fit_names_alone(made(truth, 30.0, amplitude=0.25), drift)
    without = leave_out_names(measured, ["gain_drift"])
    assert list_stand_ins(measured, without) == ["gain_drift"] * recovers


def test_a_law_that_a_half_refuses_takes_no_name(monkeypatch):
    """The drift would give way to the battery's curve; the check by halves refuses the curve.

    Coulomb friction of INTECO's thirds gave way so to an elastic friction.
    """
    drift, clock = {"gain_drift": {"per_s": 0.003}}, np.linspace(0, 30, 31)
    battery = {"drive_gain_over_time": Law(tuple(clock), tuple(-0.12 * np.exp(-clock / 9.0)))}
    truth = replace(RIG, measured_laws=battery)
    measured = fit_names_alone(made(truth, 30.0, amplitude=0.25), drift)
    monkeypatch.setattr(names_module, "is_seen_in_halves", lambda *about: False)
    assert list_stand_ins(measured, leave_out_names(measured, ["gain_drift"])) == []


LEVEL, STEP = "cart_dry_friction_along_rail", "cart_force_by_velocity"


@pytest.mark.parametrize(
    ("friction", "held"),
    [
        (None, []),
        ("cart_coulomb_friction", [LEVEL, STEP]),
        ("cart_load_friction", [LEVEL, STEP]),
        ("cart_presliding_friction", [STEP]),
    ],
)
def test_a_friction_holds_its_level_and_its_step_beside_laws(friction, held):
    """A law that could hold the same is held without it; a law that is all friction is not."""
    prepared = prepare([made(RIG, 12.0, amplitude=0.25)], RIG)
    effects = () if friction is None else (friction,)
    curves = {c.kind.name: c for c in list_curves(prepared.case, make_theta(RIG), effects)}
    parts = {LEVEL: "mean", STEP: "step"}
    assert [name for name, part in parts.items() if part in curves[name].others] == held
    assert (curves[LEVEL].low == 0.0) is (LEVEL not in held)
    of_speed = curves["cart_dry_friction_by_velocity"]
    assert ("size" in of_speed.others) is (LEVEL in held)


@pytest.mark.parametrize(("bend", "bent"), [(0.3, []), (3.0, ["input_dead_zone"])])
def test_an_effect_has_its_shape_where_a_law_of_its_kind_adds_little(bend, bent):
    """The curve beside the dead zone has 0.3 % of its power, or more than a fifth."""
    zone = {"input_dead_zone": {"width": 0.06}}
    at = np.linspace(-0.5, 0.5, 21)
    curve = {"command_curve": Law(tuple(at), tuple(bend * at * (0.5 - abs(at))))}
    truth = replace(INTECO, effects=zone, measured_laws=curve)
    prepared = prepare([made(truth, 30.0, amplitude=0.3)], INTECO)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(INTECO, effects=zone))
    begun = begin_without_laws(
        case, split, fit(case, split, ("input_dead_zone",), start, HORIZONS[0])
    )
    held = measure_laws(case, split, begun, lambda line: None)
    assert held is not None and held.kinds == ("command_curve",)
    assert list_bent(held, ["input_dead_zone"]) == bent
    assert list_sized(held, ["input_dead_zone"]) == []


@functools.cache
def measure_beside_level(level_n):
    """Return the law beside a level of dry friction that varies by 0.05 N, twice a turn."""
    turn = spread_turn(24)
    level = {"cart_coulomb_friction": {"level_n": level_n}}
    wave = {"cart_dry_friction_by_angle": Law(tuple(turn), tuple(0.05 * np.cos(2 * turn)))}
    truth = replace(INTECO, effects=level, measured_laws=wave)
    prepared = prepare([made(truth, 30.0, amplitude=0.3)], INTECO)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(INTECO, effects=level))
    begun = begin_without_laws(
        case, split, fit(case, split, ("cart_coulomb_friction",), start, HORIZONS[0])
    )
    held = measure_laws(case, split, begun, lambda line: None)
    assert held is not None and held.kinds == ("cart_dry_friction_by_angle",)
    return held


@pytest.mark.parametrize(("level_n", "bent"), [(0.5, []), (0.06, ["cart_coulomb_friction"])])
def test_a_level_of_dry_friction_is_a_name_where_the_level_hardly_varies(level_n, bent):
    assert list_bent(measure_beside_level(level_n), ["cart_coulomb_friction"]) == bent


@pytest.mark.parametrize(("band_n", "bent"), [(0.01, ["cart_coulomb_friction"]), (0.05, [])])
def test_a_law_within_its_band_bends_no_level_of_friction(band_n, bent, monkeypatch):
    """A curve of +-0.05 N that is known to 0.05 N may be no curve; the level of 0.06 N stays."""
    held = measure_beside_level(0.06)
    wide = [replace(law, band=np.full(len(law.values), band_n)) for law in widen_bands(held)]
    monkeypatch.setattr(names_module, "widen_bands", lambda measured: wide)
    assert list_bent(held, ["cart_coulomb_friction"]) == bent


def test_whole_windows_are_run_with_what_short_windows_fitted():
    case, split = prepare_with({"pole_torque_by_angle": LAWS["pole_torque_by_angle"]}, 20.0)
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    whole = measure_module.Measured(case, split, begun).over_whole_windows
    assert (begun.fit.pieces, whole.pieces) == (HORIZONS[0], 1)
    assert len(whole.window_squares) == len(split.learn.begin)
    np.testing.assert_array_equal(whole.theta, begun.fit.theta)
    assert compute_power(whole.window_squares, whole.counts)[1] > begun.fit.power[1]


def test_a_recording_with_a_single_short_push_is_asked_for_no_law_of_the_command():
    """Two samples in a thousand visit a single command, over which no curve has knots."""
    command = np.zeros(3000)
    command[100:104] = 0.45
    states = made_states(RIG, command)
    clock = np.arange(len(command)) * PERIOD_S
    rng = np.random.default_rng(0)
    cart, pole = (states[:, k] + rng.normal(0.0, 1e-4, len(command)) for k in (0, 1))
    prepared = prepare([Recording.from_arrays(clock, command, cart, pole)], RIG)
    curves = list_curves(prepared.case, make_theta(RIG), ())
    assert curves and all(np.all(np.diff(curve.knots) > 0) for curve in curves)

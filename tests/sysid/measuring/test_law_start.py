"""Laws begin beside dry friction and what the pole shows, and beside no other effect."""

from dataclasses import replace

from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.law_start import begin_laws, leave_effects_out
from pendulum_sysid.measuring.measure import begin_without_laws
from pendulum_sysid.prepare import prepare
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

RIG = Twin("rig", INTECO.rig)
HIDDEN = {"cart_coulomb_friction": {"level_n": 2.0}, "rail_tilt": {"angle_rad": 0.05}}


def test_laws_begin_beside_the_dry_friction_of_the_best_fit_alone():
    prepared = prepare([made(replace(RIG, effects=HIDDEN), 20.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    base = fit(case, split, (), make_theta(RIG), HORIZONS[0])
    best = fit(case, split, tuple(HIDDEN), base.theta, HORIZONS[0])
    start = begin_laws(base, best, ())
    assert start.effects == ("cart_coulomb_friction",)
    begun = begin_without_laws(case, split, start).fit
    level = begun.estimates["cart_coulomb_friction.level_n"].value
    assert abs(level - 2.0) < 0.4 and not begun.twin.effects.get("rail_tilt")
    assert best.choose < begun.choose < base.choose


def test_every_friction_that_holds_the_joint_everywhere_is_kept():
    prepared = prepare([made(RIG, 20.0, amplitude=0.25)], RIG)
    base = fit(prepared.case, prepared.split, (), make_theta(RIG), HORIZONS[0])
    others = ("rail_friction_patch", "friction_warming", "cart_quadratic_drag", "rail_tilt")
    dry = ("cart_presliding_friction", "cart_load_friction", "pole_coulomb_friction")
    assert begin_laws(base, replace(base, effects=others + dry), ()).effects == dry


def test_a_base_that_has_the_dry_friction_stays_as_it_is():
    prepared = prepare([made(RIG, 20.0, amplitude=0.25)], RIG)
    base = fit(prepared.case, prepared.split, ("cart_coulomb_friction",), make_theta(RIG), 1)
    assert begin_laws(base, base, ()).effects == base.effects


def test_what_the_pole_shows_by_itself_is_kept():
    prepared = prepare([made(RIG, 20.0, amplitude=0.25)], RIG)
    base = fit(prepared.case, prepared.split, (), make_theta(RIG), HORIZONS[0])
    best = replace(base, effects=("rail_tilt", "eccentric_encoder", "cart_coulomb_friction"))
    shown = {"eccentric_encoder"}
    assert begin_laws(base, best, shown).effects == ("eccentric_encoder", "cart_coulomb_friction")


def test_effects_that_are_left_out_are_neutral():
    prepared = prepare([made(replace(RIG, effects=HIDDEN), 20.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    theta = make_theta(replace(RIG, effects=HIDDEN))
    best = fit(case, split, tuple(HIDDEN), theta, HORIZONS[0])
    start = leave_effects_out(best, ["rail_tilt"])
    assert start.effects == ("cart_coulomb_friction",)
    assert start.theta[SLOTS["rail_tilt"]] == 0.0 and best.theta[SLOTS["rail_tilt"]] != 0.0
    assert leave_effects_out(best, ()).effects == best.effects

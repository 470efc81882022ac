"""Laws begin beside the dry friction of the best fit, and beside no other effect of it."""

from dataclasses import replace

from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.dry_start import keep_dry_friction
from pendulum_sysid.measuring.measure import begin_without_laws
from pendulum_sysid.prepare import prepare
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG = Twin("rig", INTECO.rig)
HIDDEN = {"cart_coulomb_friction": {"level_n": 2.0}, "rail_tilt": {"angle_rad": 0.05}}


def test_laws_begin_beside_the_dry_friction_of_the_best_fit_alone():
    prepared = prepare([made(replace(RIG, effects=HIDDEN), 20.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    base = fit(case, split, (), make_theta(RIG), HORIZONS[0])
    best = fit(case, split, tuple(HIDDEN), base.theta, HORIZONS[0])
    start = keep_dry_friction(base, best)
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
    assert keep_dry_friction(base, replace(base, effects=others + dry)).effects == dry


def test_a_base_that_has_the_dry_friction_stays_as_it_is():
    prepared = prepare([made(RIG, 20.0, amplitude=0.25)], RIG)
    base = fit(prepared.case, prepared.split, ("cart_coulomb_friction",), make_theta(RIG), 1)
    assert keep_dry_friction(base, base).effects == base.effects

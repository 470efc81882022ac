"""Names whose intervals hold that nothing is there, at the noise and above it."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.made_recordings import INTECO

from pendulum_sysid.finding import naming
from pendulum_sysid.finding.environments import Steadiness
from pendulum_sysid.finding.judge import Lead, compute_distance, is_surely_there
from pendulum_sysid.finding.naming import Named, doubt_intervals, part_sure_names
from pendulum_sysid.finding.propose import Proposal
from pendulum_sysid.fitting.parameters import list_effect_parameters
from pendulum_sysid.records import Estimate
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Scale
from pendulum_twin.parameter_vector import SLOTS, make_theta

ABOVE, AT_NOISE = 20.0, 1.0  # misfits, in units of noise
TIED = {"rail_tilt.angle_rad": Estimate(0.0036, -1e-5, 0.0072)}
SCALES = dict.fromkeys(Scale, 1.0) | {Scale.COMMAND: 0.5}
SURE = {"rail_tilt.angle_rad": Estimate(0.0036, 0.0018, 0.0054)}


def make_fit(
    misfit: float,
    estimates: dict[str, Estimate],
    effects: tuple[str, ...] = (),
) -> SimpleNamespace:
    return SimpleNamespace(choose=misfit, estimates=estimates, effects=effects)


@pytest.mark.parametrize(
    ("misfit", "estimates", "lasting"),
    [(ABOVE, TIED, False), (ABOVE, SURE, True), (AT_NOISE, TIED, False), (AT_NOISE, SURE, True)],
)
def test_a_size_that_may_be_nothing_is_no_name(
    misfit: float, estimates: dict[str, Estimate], lasting: bool
) -> None:
    """At the noise over a quarter of a second, whole seconds may widen an interval, too."""
    best, widened = make_fit(misfit, SURE), make_fit(misfit, estimates)
    (named,) = doubt_intervals(best, widened, [Named("rail_tilt", Lead(1.1, 9.0))], SCALES)
    assert named.is_lasting is lasting


def test_an_interval_that_nothing_widens_is_not_doubted() -> None:
    best = make_fit(AT_NOISE, TIED)
    (named,) = doubt_intervals(best, best, [Named("rail_tilt", Lead(1.1, 9.0))], SCALES)
    assert named.is_lasting


@pytest.mark.parametrize(
    ("name", "misfit", "most", "lasting"),
    [
        ("coarse_command", ABOVE, False, False),
        ("coarse_command", ABOVE, True, True),
        ("coarse_command", AT_NOISE, False, True),
        ("rail_tilt", ABOVE, False, True),
        ("encoder_slip", ABOVE, False, True),
        ("cart_sign_inverted", ABOVE, False, True),
    ],
)
def test_above_the_noise_an_effect_that_no_environment_tells_has_to_explain_most(
    monkeypatch: pytest.MonkeyPatch, name: str, misfit: float, most: bool, lasting: bool
) -> None:
    """Two swing-ups of the Quanser rig had two steps of the command, beside much that is left."""
    steady = Steadiness(np.ones(9), np.full(9, 0.05))
    monkeypatch.setattr(naming, "replicate_effects", lambda *about: {})
    monkeypatch.setattr(naming, "measure_steadiness", lambda *about: {"rail_tilt": steady})
    monkeypatch.setattr(naming, "list_cancelled", lambda *about: frozenset())
    monkeypatch.setattr(naming, "weigh_effect", lambda *about: 1.0)
    search, best = SimpleNamespace(case=None, split=None), make_fit(misfit, {}, (name,))
    effects = [Named(name, Lead(1.2, 9.0), explains_most=most)]
    (named,) = naming.add_replications(search, best, effects, ())  # type: ignore[arg-type]
    assert named.is_lasting is lasting


def test_a_rival_whose_fit_ends_on_its_way_begins_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Near upright a fit of dry friction, begun without any, ended at 2.7 times the noise."""
    load, dry = SLOTS["cart_load_friction"], SLOTS["cart_coulomb_friction"]
    theta = make_theta(INTECO)
    best_theta, less_theta, far_theta = theta.copy(), theta.copy(), theta.copy()
    best_theta[load], far_theta[dry] = 0.08, 0.5
    best_theta[0] *= 2.0
    fits = {
        name: SimpleNamespace(theta=vector, train=train, effects=effects)
        for name, vector, train, effects in (
            ("best", best_theta, 0.9, ("cart_load_friction",)),
            ("less", less_theta, 25.0, ()),
            ("far", far_theta, 2.7, ("cart_coulomb_friction",)),
        )
    }

    def fit_effects(effects: tuple[str, ...], start: object, vector: Floats) -> SimpleNamespace:
        if start is fits["less"]:
            return fits["far"]
        assert vector[0] == best_theta[0] and vector[dry] == 0.5 and vector[load] == 0.0
        return SimpleNamespace(theta=vector, train=0.9, effects=effects)

    monkeypatch.setattr(
        naming, "compute_lead", lambda rich, simple: Lead(simple.train / rich.train, 9.0)
    )
    monkeypatch.setattr(naming, "is_needed", lambda rich, simple, effect: True)
    proposal = Proposal("cart_coulomb_friction", ("cart_coulomb_friction",), far_theta[None], 9.0)
    search = SimpleNamespace(fit_effects=fit_effects)
    fit = naming._fit_rival(search, fits["best"], fits["less"], "cart_load_friction", proposal)
    assert fit.train == 0.9


@pytest.mark.parametrize("as_good", [True, False])
def test_what_does_as_well_is_asked_what_it_contains(
    monkeypatch: pytest.MonkeyPatch, as_good: bool
) -> None:
    """Plain dry friction stood in no list of ties: far from the fit it ranked tenth."""
    plain, elastic = "cart_coulomb_friction", "cart_presliding_friction"
    ranked = [elastic, "rail_tilt", "rail_spring", plain]
    proposals = [Proposal(name, (name,), None, 9.0 - k) for k, name in enumerate(ranked)]  # type: ignore[arg-type]
    asked = []

    def fit_rival(search: object, best: object, less: object, name: str, rival: Proposal) -> str:
        asked.append(rival.effect)
        return rival.effect

    monkeypatch.setattr(naming.decisions, "RIVALS_REFITTED", 1)
    monkeypatch.setattr(naming, "fit_without_effect", lambda *about: "less")
    monkeypatch.setattr(naming, "propose", lambda *about: proposals)
    monkeypatch.setattr(naming, "_fit_rival", fit_rival)
    monkeypatch.setattr(naming, "is_needed", lambda *about: as_good)
    monkeypatch.setattr(naming, "is_outdone", lambda *about: False)
    monkeypatch.setattr(naming, "compute_lead", lambda *about: SimpleNamespace(is_real=False))
    monkeypatch.setattr(naming, "is_most_explained", lambda *about: True)
    journal = SimpleNamespace(note=lambda *about: None)
    search = SimpleNamespace(case=None, split=None, refuted=(), journal=journal)
    named = naming._exchange_and_compare(search, "best", "cart_load_friction")  # type: ignore[arg-type]
    assert asked == ([elastic, plain] if as_good else [elastic])
    assert named.inseparable_from == ((elastic, plain) if as_good else ())
    assert named.explains_most


@pytest.mark.parametrize(
    ("leads", "outdone", "steady", "as_good"),
    [
        (False, False, None, True),
        (True, False, True, True),
        (True, False, False, False),
        (True, False, None, False),
        (True, True, True, False),
    ],
    ids=["level", "behind and steady", "behind and not", "behind without a size", "outdone"],
)
def test_a_rival_behind_is_no_tie_unless_it_is_steady(
    monkeypatch: pytest.MonkeyPatch,
    leads: bool,
    outdone: bool,
    steady: bool | None,
    as_good: bool,
) -> None:
    """Saturations, behind by little, stood beside the friction of the INTECO cart as ties."""
    asked = {} if steady is None else {"input_saturation": SimpleNamespace(is_steady=steady)}
    monkeypatch.setattr(naming, "is_needed", lambda *about: True)
    monkeypatch.setattr(naming, "is_outdone", lambda *about: outdone)
    monkeypatch.setattr(naming, "compute_lead", lambda *about: SimpleNamespace(is_real=leads))
    monkeypatch.setattr(naming, "measure_steadiness", lambda *about: asked)
    search = SimpleNamespace(case=None, split=None)
    fits = ("other", "best", "less")
    assert naming._does_as_well(search, *fits, "input_saturation") is as_good  # type: ignore[arg-type]


def test_of_several_sizes_one_that_is_surely_there_suffices() -> None:
    """An eccentric encoder has a sine and a cosine part, and may have one alone."""
    sine = {"eccentric_encoder.sine_rad": Estimate(0.005, 0.004, 0.006)}
    cosine = {"eccentric_encoder.cosine_rad": Estimate(0.0, -0.001, 0.001)}
    assert is_surely_there(make_fit(ABOVE, sine | cosine), "eccentric_encoder", SCALES)
    assert not is_surely_there(make_fit(ABOVE, cosine), "eccentric_encoder", SCALES)


@pytest.mark.parametrize(
    ("low", "high", "there"),
    [(-0.0147, -0.0009, False), (-0.0147, -0.0025, True), (0.0009, -0.0009, True)],
    ids=["by a hair", "surely", "by both"],
)
def test_several_sizes_are_sure_by_the_region_of_all(low: float, high: float, there: bool) -> None:
    """A size of 0.0073 [0.0009, 0.0166] made a disc that wobbles an eccentric disc."""
    sine = {"eccentric_encoder.sine_rad": Estimate(0.0075, low, 0.0207)}
    cosine = {"eccentric_encoder.cosine_rad": Estimate(-0.0073, -0.0166, high)}
    assert is_surely_there(make_fit(ABOVE, sine | cosine), "eccentric_encoder", SCALES) is there


def test_an_effect_without_a_size_has_no_interval_to_doubt() -> None:
    assert is_surely_there(make_fit(ABOVE, {}), "cart_sign_inverted", SCALES)


@pytest.mark.parametrize(
    ("value", "low", "high", "there"),
    [(2.0, 1.4, 2.0, False), (1.9, 1.5, 2.0, False), (0.8, 0.7, 0.9, True), (0.8, 0.8, 0.8, True)],
)
def test_a_limit_that_may_lie_beyond_its_bound_is_not_there(
    value: float, low: float, high: float, there: bool
) -> None:
    """Its value of nothing, 1e6, left out by 1e306 half widths, ended a diagnosis in an error."""
    limit = {"soft_saturation.limit": Estimate(value, low, high, True, value == 2.0)}
    assert is_surely_there(make_fit(ABOVE, limit), "soft_saturation", SCALES) is there


def test_the_place_of_an_effect_is_no_size() -> None:
    """A patch is somewhere, whatever its level: its centre proves nothing."""
    patch = {
        "rail_friction_patch.centre_m": Estimate(0.3, 0.29, 0.31),
        "rail_friction_patch.level_n": Estimate(0.2, 0.0, 0.7),
    }
    assert not is_surely_there(make_fit(ABOVE, patch), "rail_friction_patch", SCALES)


WIDEST = next(
    free.high
    for free in list_effect_parameters(BY_NAME["rail_drag_patch"], SCALES)
    if free.name == "rail_drag_patch.width_m"
)


@pytest.mark.parametrize(("widest", "there"), [(WIDEST, False), (0.9 * WIDEST, True)])
def test_a_drag_as_wide_as_the_rail_is_at_no_place(widest: float, there: bool) -> None:
    """A cable that hangs from the rail drags everywhere, and a patch of any width explains it."""
    patch = {
        "rail_drag_patch.n_s_per_m": Estimate(0.20, 0.005, 0.42),
        "rail_drag_patch.centre_m": Estimate(0.29, 0.14, 0.49),
        "rail_drag_patch.width_m": Estimate(0.34, 0.1, widest),
    }
    assert is_surely_there(make_fit(ABOVE, patch), "rail_drag_patch", SCALES) is there


@pytest.mark.parametrize(("low", "high", "there"), [(-5.25, 4.94, False), (1.2, 2.7, True)])
def test_a_wave_that_may_have_any_phase_is_not_there(low: float, high: float, there: bool) -> None:
    """A third of a recording had a pulley off its axis, which no other part of it has."""
    pulley = {
        "eccentric_pulley.ratio": Estimate(0.0101, 0.00378, 0.0196),
        "eccentric_pulley.period_m": Estimate(0.231, 0.138, 0.277),
        "eccentric_pulley.phase_rad": Estimate(1.95, low, high),
    }
    assert is_surely_there(make_fit(ABOVE, pulley), "eccentric_pulley", SCALES) is there


@pytest.mark.parametrize(("high", "there"), [(1e6, False), (1.1, True)])
def test_a_friction_that_may_never_level_off_is_not_there(high: float, there: bool) -> None:
    """Beside a law of the cart's speed any limit did: 0.81 N [0, 1e6] was a sure name."""
    friction = {
        "cart_saturating_friction.viscous_n_s_m": Estimate(3.85, 2.65, 4.89),
        "cart_saturating_friction.level_n": Estimate(0.0, 0.0, 1e6, False, True),
        "cart_saturating_friction.limit_n": Estimate(0.81, 0.0, high, False),
    }
    assert is_surely_there(make_fit(ABOVE, friction), "cart_saturating_friction", SCALES) is there


@pytest.mark.parametrize(("high", "there"), [(1e3, False), (1.5, True)])
def test_a_friction_that_may_never_fade_is_not_there(high: float, there: bool) -> None:
    friction = {
        "cart_stribeck_friction.level_n": Estimate(0.0, 0.0, 1e6, False, True),
        "cart_stribeck_friction.static_n": Estimate(0.28, 0.2, 0.36),
        "cart_stribeck_friction.velocity_m_s": Estimate(0.5, 0.0001, high, False),
    }
    assert is_surely_there(make_fit(ABOVE, friction), "cart_stribeck_friction", SCALES) is there


def test_a_belt_with_any_damping_is_a_belt() -> None:
    belt = {
        "stretching_belt.period_s": Estimate(0.08, 0.07, 0.09),
        "stretching_belt.damping": Estimate(0.2, 0.0, 0.95),
        "stretching_belt.motor_share": Estimate(0.1, 0.0, 0.8),
    }
    assert is_surely_there(make_fit(ABOVE, belt), "stretching_belt", SCALES)


@pytest.mark.parametrize(("high", "there"), [(0.46, True), (0.52, False)])
def test_a_limit_that_may_lie_above_the_largest_command_is_none(high: float, there: bool) -> None:
    """A limit of 0.478 [0.449, 0.524] was named in a recording with commands up to 0.5."""
    limit = {"input_saturation.limit": Estimate(0.44, 0.42, high)}
    assert is_surely_there(make_fit(ABOVE, limit), "input_saturation", SCALES) is there


def test_names_are_parted_by_the_sizes_that_measured_laws_leave() -> None:
    """A curve of the force by velocity may take over what an asymmetry stood for."""
    names = (Named("rail_tilt", Lead(1.1, 9.0)), Named("cart_sign_inverted", Lead(9.0, 9.0)))
    effects = tuple(named.effect for named in names)
    assert part_sure_names(make_fit(ABOVE, TIED, effects), names, SCALES, ()) == (
        names[1:],
        names[:1],
    )
    assert part_sure_names(make_fit(ABOVE, SURE, effects), names, SCALES, ()) == (names, ())


def test_a_name_whose_place_a_measured_law_has_taken_is_gone() -> None:
    names = (Named("position_scale", Lead(1.1, 9.0)),)
    assert part_sure_names(make_fit(ABOVE, {}), names, SCALES, ()) == ((), ())


@pytest.mark.parametrize("bent", [True, False])
def test_a_name_whose_shape_a_measured_law_bends_is_not_sure(bent: bool) -> None:
    """A tilt beside a large force along the rail may be any tilt."""
    names = (Named("rail_tilt", Lead(1.1, 9.0)),)
    fit = make_fit(ABOVE, SURE, ("rail_tilt",))
    sure = part_sure_names(fit, names, SCALES, ("rail_tilt",) if bent else ())
    assert sure == (((), names) if bent else (names, ()))


@pytest.mark.parametrize(("weight", "lasting"), [(0.05, False), (0.5, False), (0.95, True)])
def test_a_name_that_few_good_sets_hold_is_none(weight: float, lasting: bool) -> None:
    """Parsimony names the smallest set; other sets may predict as well without the name."""
    assert Named("belt_backlash", Lead(1.1, 9.0), weight=weight).is_lasting is lasting


def test_a_slack_that_is_crossed_within_half_a_step_is_no_size() -> None:
    for gap_m, there in ((8.8e-7, False), (1e-4, True)):
        estimates = {"belt_backlash.gap_m": Estimate(gap_m, 0.5 * gap_m, 1.5 * gap_m)}
        fit = SimpleNamespace(estimates=estimates, noise=(6e-5, 1e-3))
        assert (compute_distance(fit, "belt_backlash") > 1.0) is there

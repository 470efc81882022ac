"""The verdict: every field, sentences for every outcome, and no name for what has none."""

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import CART_STEP_M, INTECO, POLE_STEP_RAD, make_command, record_hidden
from support.made_recordings import PERIOD_S, made, made_states, without_joint

from pendulum_bridge.emulator.load import add_load
from pendulum_sysid import decisions, pipeline
from pendulum_sysid.finding.detectors import Reading
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.search import Named
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.records import Estimate, Outcome, Recording
from pendulum_sysid.telling.likeness import compute_floor_ratio, is_unlike
from pendulum_sysid.telling.outcome import Findings, decide_outcome, list_certain
from pendulum_sysid.telling.verdict import make_verdict
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.model import Twin, parse_twin
from pendulum_twin.rig import UNITS
from pendulum_twin.signals import Signals

COULOMB = {"cart_coulomb_friction": {"level_n": 0.5}}
CERTAIN = Reading("cart_coulomb_friction", (0.34,), {"level_n": Estimate(0.34, 0.2, 0.6)})


def silent(_: str) -> None:
    pass


def assert_as_in_the_contract(found: dict) -> None:
    assert Verdict.from_dict(found).to_dict() == found
    assert set(found) == {
        "schema", "outcome", "sentence", "location", "missing_physics", "rig_parameters",
        "masking", "fit", "remainder", "data_quality", "next_experiment", "recording", "elapsed_s",
        "warnings", "perhaps", "sets", "measured_laws", "unlike_rig", "effect_parameters",
        "correlations", "given_stays", "rig_changed",
    }  # fmt: skip
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["schema"] == "pendulum_verdict/1" and found["outcome"] in {
        one.value for one in Outcome
    }
    assert found["sentence"] and "\n" not in found["sentence"]
    for one in found["missing_physics"]:
        assert set(one) == {
            "effect",
            "cannot_be_told_from",
            "confidence",
            "parameters",
            "sentence",
            "replicated",
            "weight",
        }
        units = {p.name: p.unit for p in BY_NAME[one["effect"]].parameters}
        assert {name: held["unit"] for name, held in one["parameters"].items()} == units
        assert all(
            held["low"] <= held["value"] <= held["high"] for held in one["parameters"].values()
        )
        assert 0.0 <= one["confidence"] <= 1.0 and "{" not in one["sentence"]
        assert not {one["effect"]} & set(one["cannot_be_told_from"])
    for name, one in found["rig_parameters"].items():
        assert {"before", "after", "low", "high", "unit", "identifiable"} <= set(one)
        assert one["unit"] == UNITS[name] and one["low"] <= one["after"] <= one["high"]
    if found["location"] is not None:
        assert found["location"]["place"] in {place.value for place in Place}
        assert all(
            set(one) == {"variable", "finding", "share"} for one in found["location"]["evidence"]
        )
        assert all(0 <= begin < end for begin, end in found["location"]["intervals_s"])
    if found["fit"] is not None:
        assert {"train", "held_out", "noise_floor", "unit"} <= set(found["fit"]) and found["fit"][
            "unit"
        ] == "score"
        assert set(found["fit"]["train"]) == set(found["fit"]["held_out"]) == {"before", "after"}
    if found["remainder"] is not None:
        always = {"place", "above_noise_floor", "finding"}
        assert set(found["remainder"]) - {"repeats", "wandering", "whole_windows"} == always
    for one in found["data_quality"]:
        assert set(one) == {"kind", "count", "intervals_s"}
    assert {"seconds", "samples", "rate_hz", "digest"} <= set(found["recording"]) and found[
        "elapsed_s"
    ] >= 0


# Every field, on every kind of recording


@pytest.fixture(scope="module")
def friction() -> tuple[dict, Findings]:
    """A diagnosis of hidden dry friction, and the findings that its verdict was made from."""
    kept: list[Findings] = []

    def spy(findings: Findings, recording: Recording, elapsed_s: float) -> Verdict:
        kept.append(findings)
        return make_verdict(findings, recording, elapsed_s)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "make_verdict", spy)
        return diagnose([record_hidden(COULOMB, 5, 24.0)[0]], INTECO, silent).to_dict(), kept[0]


def test_named(friction: tuple[dict, Findings]) -> None:
    found, _ = friction
    assert_as_in_the_contract(found)
    (one,) = found["missing_physics"]
    assert (
        found["outcome"] == "named"
        and one["effect"] == "cart_coulomb_friction"
        and one["confidence"] > 0.95
    )
    assert found["location"]["place"] == "cart"
    absorbed = "cart_viscous_n_s_m had absorbed the missing cart_coulomb_friction"
    assert any(line.startswith(absorbed) for line in found["masking"])
    assert found["sentence"].startswith("Dry friction holds the cart back with 0.")
    assert (
        "held-out errors over 1 s fall: cart " in found["sentence"]
        and " mrad." in found["sentence"]
    )
    assert found["fit"]["held_out"]["after"] < 0.1 * found["fit"]["held_out"]["before"]
    assert found["fit"]["held_out_cart_mm"]["after"] < 1.0
    size, true = one["parameters"]["level_n"], COULOMB["cart_coulomb_friction"]["level_n"]
    assert size["value"] == pytest.approx(true, rel=0.05)
    assert size["low"] <= size["value"] <= size["high"] and found["remainder"] is None
    facts = dict(found["recording"])
    visited = facts.pop("visited")
    assert {"cart_position", "pole_angle", "command"} < set(visited)
    assert all(low < high for low, high in visited.values())
    assert facts == {
        "name": "hidden", "seconds": 24.0, "samples": 2400, "rate_hz": pytest.approx(100.0),
        "digest": "sha256:5", "position_step_m": pytest.approx(57e-6, rel=1e-6),
        "angle_step_rad": pytest.approx(2 * np.pi / 4096, rel=1e-6),
    }  # fmt: skip


def test_a_value_of_the_given_twin_that_changed_is_told() -> None:
    """A rig whose friction has doubled lacks no physics: the twin has the effect."""
    given = replace(INTECO, effects=COULOMB)
    worn = {"cart_coulomb_friction": {"level_n": 1.0}}
    verdict = diagnose([record_hidden(worn, 5, 20.0)[0]], given, silent)
    assert verdict.outcome is Outcome.NOTHING_MISSING
    assert "are enough (" in verdict.sentence and "cart_coulomb_friction.level_n 0.5 -> 1" in (
        verdict.sentence
    )
    friction = verdict.effect_parameters["cart_coulomb_friction.level_n"]
    assert friction.before == 0.5 and friction.low < 1.0 < friction.high
    assert verdict.list_given_values()["cart_coulomb_friction.level_n"] is friction


def test_a_load_on_the_cart_is_told_and_not_the_constants_that_it_bends() -> None:
    recording, truth = record_hidden({}, 5, 20.0)
    verdict = diagnose([recording], replace(truth, rig=add_load(truth.rig, -0.2)), silent)
    assert verdict.outcome is Outcome.NOTHING_MISSING
    assert "are enough (cart_mass_kg 0.372 -> 0.57" in verdict.sentence
    assert any("with a cart of 0.57" in warning for warning in verdict.warnings)


def test_friction_is_told_as_that_of_the_cart_with_its_load() -> None:
    """With the given mass every force comes out smaller, by more than its interval allows."""
    recording, truth = record_hidden({"cart_coulomb_friction": {"level_n": 0.51}}, 5, 20.0)
    given = replace(truth, rig=add_load(truth.rig, -0.2), effects=COULOMB)
    verdict = diagnose([recording], given, silent)
    assert "are enough (cart_mass_kg 0.372 -> 0.57" in verdict.sentence
    assert "cart_coulomb_friction" not in verdict.sentence


def test_unusable() -> None:
    verdict = diagnose([made(INTECO, 3.0)], INTECO, silent)
    assert_as_in_the_contract(verdict.to_dict())
    assert verdict.outcome is Outcome.UNUSABLE
    assert verdict.twin is None and verdict.fit is None
    assert verdict.sentence.startswith("expected at least 4 usable windows")
    assert verdict.sentence.endswith("record longer")


@pytest.mark.parametrize(("gone", "left"), [("pole", "cart_mm"), ("cart", "pole_rad")])
def test_one_joint_alone(gone: str, left: str) -> None:
    found = diagnose([without_joint(made(INTECO, 12.0, 0.2), gone)], INTECO, silent).to_dict()
    assert_as_in_the_contract(found)
    other = {"cart_mm": "pole_rad", "pole_rad": "cart_mm"}[left]
    assert f"held_out_{left}" in found["fit"] and f"held_out_{other}" not in found["fit"]
    assert not any(name.startswith(gone) for name in found["rig_parameters"])


def test_runs_that_diverge_leave_no_infinity_in_the_verdict(
    friction: tuple[dict, Findings],
) -> None:
    _, kept = friction
    before = {
        part: replace(runs, runs=np.full_like(runs.runs, np.inf))
        for part, runs in kept.before.items()
    }
    found = make_verdict(replace(kept, before=before), kept.case.recording, 1.0).to_dict()
    assert_as_in_the_contract(found)
    assert found["fit"]["held_out"]["before"] is None and found["fit"]["train"]["before"] is None
    assert found["fit"]["held_out"]["after"] == friction[0]["fit"]["held_out"]["after"]


def test_a_hopeless_twin_is_not_the_recording_s_fault() -> None:
    hopeless = replace(INTECO, effects={"rail_spring": {"n_per_m": -2e3, "centre_m": 0.0}})
    found = diagnose([record_hidden({}, 5, 10.0)[0]], hopeless, silent).to_dict()
    assert_as_in_the_contract(found)
    assert "check the command topic" not in found["sentence"]


def test_several_recordings_are_one() -> None:
    both = [made(INTECO, 8.0, 0.2, seed) for seed in (1, 2)]
    found = diagnose(both, INTECO, silent).to_dict()
    assert_as_in_the_contract(found)
    assert found["outcome"] == "nothing_missing" and found["recording"]["samples"] == 1600
    assert found["location"] is None and found["missing_physics"] == []
    assert found["recording"]["digest"] == "sha256:1 + sha256:2"


# The words of the other outcomes, from findings that end in them


def test_rivals_make_it_ambiguous(friction: tuple[dict, Findings]) -> None:
    _, kept = friction
    tied = replace(kept.named[0], inseparable_from=("input_dead_zone", "rail_tilt"))
    found = make_verdict(replace(kept, named=(tied,)), kept.case.recording, 1.0).to_dict()
    assert_as_in_the_contract(found)
    assert found["outcome"] == "ambiguous"
    assert (
        "cart_coulomb_friction cannot be told from input_dead_zone, rail_tilt on this recording."
        in found["sentence"]
    )
    assert found["missing_physics"][0]["confidence"] <= 1 / 3


def test_effects_that_explain_less_than_half_are_not_the_answer(
    friction: tuple[dict, Findings],
) -> None:
    _, kept = friction
    sign = Named("cart_sign_inverted", kept.named[0].lead, ())
    far = replace(kept.best, choose=20.0)
    missed = replace(
        kept, base=replace(kept.base, choose=25.0), best=far, named=(sign, *kept.named)
    )
    found = make_verdict(missed, kept.case.recording, 1.0).to_dict()
    assert_as_in_the_contract(found)
    assert found["outcome"] == "not_in_catalogue"
    assert [one["effect"] for one in found["missing_physics"]] == [
        "cart_sign_inverted"
    ]  # a sign is sure in any case
    place = found["location"]["place"]
    assert found["sentence"].startswith(
        f"Physics is missing at the {place} that no effect of the catalogue explains; "
    )
    explained = replace(missed, base=replace(kept.base, choose=40.0))
    assert decide_outcome(explained) is Outcome.NAMED


def test_a_small_part_or_none_is_no_answer_while_whole_windows_show_more_than_noise(
    friction: tuple[dict, Findings],
) -> None:
    kept = friction[1]
    small = replace(kept, base=replace(kept.base, choose=1.2), best=replace(kept.best, choose=1.0))
    outcomes = {
        misfit: decide_outcome(replace(small, learned_misfit=misfit)) for misfit in (1.0, 4.0)
    }
    assert outcomes == {1.0: Outcome.NAMED, 4.0: Outcome.NOT_IN_CATALOGUE}
    told = make_verdict(replace(small, learned_misfit=4.0), kept.case.recording, 1.0)
    assert told.sentence.count("4 times the sensors' noise over whole windows") == 1
    assert decide_outcome(replace(kept, learned_misfit=4.0)) is Outcome.NAMED  # a great part
    unnamed = replace(small, named=(), learned_misfit=4.0)
    assert decide_outcome(unnamed) is Outcome.NOT_IN_CATALOGUE
    assert decide_outcome(replace(unnamed, learned_misfit=1.0)) is Outcome.NOTHING_MISSING


def test_whole_windows_are_judged_from_the_start_states_of_the_fit(
    friction: tuple[dict, Findings],
) -> None:
    kept = friction[1]
    assert kept.best.pieces == 1
    assert kept.learned_misfit == pytest.approx(kept.best.train, rel=1e-3)


def test_friction_that_is_certain_is_kept_where_something_else_has_no_name(
    friction: tuple[dict, Findings],
) -> None:
    _, kept = friction
    far = replace(kept.best, choose=20.0)
    missed = replace(kept, base=replace(kept.base, choose=25.0), best=far, certain=(CERTAIN,))
    found = make_verdict(missed, kept.case.recording, 1.0).to_dict()
    assert_as_in_the_contract(found)
    assert found["outcome"] == "not_in_catalogue" and found["perhaps"] == []
    (one,) = found["missing_physics"]
    assert (
        one["effect"] == "cart_coulomb_friction" and one["parameters"]["level_n"]["value"] == 0.34
    )
    assert found["sentence"].endswith(
        " Dry friction holds the cart back with 0.34 N. This part is certain."
    )
    named = make_verdict(
        replace(missed, base=replace(kept.base, choose=40.0)), kept.case.recording, 1.0
    ).to_dict()
    assert named["outcome"] == "named" and "certain" not in named["sentence"]


def test_friction_that_may_be_the_named_friction_is_not_told_twice(
    friction: tuple[dict, Findings],
) -> None:
    named = friction[1].named
    load = replace(CERTAIN, effect="cart_load_friction")
    assert list_certain(replace(friction[1], certain=(load,)), named) == (load,)
    assert list_certain(replace(friction[1], certain=(CERTAIN,)), named) == ()
    either = replace(load, inseparable_from=("cart_coulomb_friction",))
    assert list_certain(replace(friction[1], certain=(either,)), named) == ()


# A recording that does not look like its rig


def replace_after(findings: Findings, errors: float) -> Findings:
    """Return the findings with an improved twin whose held-out errors are so many times larger."""
    runs = findings.after["held_out"]
    far = replace(runs, runs=runs.measured + errors * (runs.runs - runs.measured))
    return replace(findings, after={**findings.after, "held_out": far})


def test_a_twin_far_above_its_floor_that_follows_the_motion_is_of_this_rig(
    friction: tuple[dict, Findings],
) -> None:
    kept = replace_after(friction[1], 30.0)
    assert compute_floor_ratio(kept) > decisions.UNLIKE_FLOORS
    assert not is_unlike(kept) and not is_unlike(friction[1])


def test_a_twin_far_above_its_floor_that_does_not_follow_is_not_of_this_rig(
    friction: tuple[dict, Findings],
) -> None:
    kept = replace_after(friction[1], 3000.0)
    found = make_verdict(kept, kept.case.recording, 1.0).to_dict()
    assert_as_in_the_contract(found)
    assert found["unlike_rig"] and found["sentence"].startswith(
        "This recording does not look like this rig: the improved twin's error over 1 s is "
    )
    assert (
        "Closest comes, and is not certain: Dry friction holds the cart back"
        in (found["sentence"])
    )
    assert "This part is certain" not in found["sentence"]
    assert found["outcome"] == "not_in_catalogue" and found["missing_physics"] == []
    assert [effect["effect"] for effect in found["perhaps"]] == ["cart_coulomb_friction"]
    assert "errors over 1 s change: cart" in found["sentence"]  # they do not fall


def test_what_is_read_off_an_unlike_recording_is_told_too(
    friction: tuple[dict, Findings],
) -> None:
    """A lag of the reported velocities is read off, and is no effect of the fit."""
    kept = replace_after(friction[1], 3000.0)
    lag = Named("velocity_filter", Lead(2.0, 5.0))
    size = {"velocity_filter.time_constant_s": Estimate(0.03, 0.02, 0.04)}
    fit = replace(kept.best, estimates={**kept.best.estimates, **size})
    kept = replace(kept, best=fit, named=(*kept.named, lag))
    found = make_verdict(kept, kept.case.recording, 1.0).to_dict()
    assert found["missing_physics"] == []
    names = [effect["effect"] for effect in found["perhaps"]]
    assert names == ["cart_coulomb_friction", "velocity_filter"]


@pytest.mark.parametrize(
    ("errors", "misfit", "says"),
    [
        (1.0, 1.0, "Nothing is missing"),
        (2.0, 2.0, "Nothing is missing"),
        (12.0, 12.0, "Physics is missing"),
        (60.0, 60.0, "does not look like this rig"),
        (12.0, 1.0, "Nothing is missing"),
    ],
)
def test_nothing_is_missing_only_where_the_score_is_near_its_floor(
    friction: tuple[dict, Findings], errors: float, misfit: float, says: str
) -> None:
    """Or where a start state that is fitted, and not smoothed, brings a run to the noise."""
    kept = replace(replace_after(friction[1], errors), named=(), base=friction[1].best)
    kept = replace(kept, held_out_misfit=misfit)
    found = make_verdict(kept, kept.case.recording, 1.0).to_dict()
    missing = "nothing_missing" if "Nothing" in says else "not_in_catalogue"
    assert says in found["sentence"] and found["outcome"] == missing
    assert found["unlike_rig"] == ("does not look" in says)
    if says == "Physics is missing":
        assert f"{found['fit']['floors']['after']:.2g} times the noise floor" in found["sentence"]


def test_nothing_is_surely_missing_where_the_twin_has_effects_that_are_not_sure(
    friction: tuple[dict, Findings],
) -> None:
    """'Other parameters are enough' stood beside effects of the improved twin."""
    doubted = tuple(replace(effect, is_sure=False) for effect in friction[1].named)
    kept = replace(friction[1], named=(), perhaps=doubted, base=friction[1].best)
    found = make_verdict(kept, kept.case.recording, 1.0).to_dict()
    assert found["outcome"] == "nothing_missing"
    assert found["sentence"].startswith("Nothing is surely missing: other parameters")
    assert "with effects of which none is sure (cart_coulomb_friction);" in found["sentence"]


def test_a_hundred_noise_floors_and_more_are_told_in_full(
    friction: tuple[dict, Findings],
) -> None:
    kept = friction[1]
    best, base = replace(kept.best, choose=140.0), replace(kept.base, choose=150.0)
    far = replace(kept, best=best, base=base, named=(), learned_misfit=140.0)
    sentence = make_verdict(far, kept.case.recording, 1.0).sentence
    assert ", 140 times the sensors' noise over whole windows (" in sentence


# What the catalogue does not hold: a rig of its own equations, with something added

Push = Callable[
    [float, tuple[float, float, float, float], float], float
]  # time, (x, th, v, w), drive -> N or N m
RIG = replace(
    INTECO.rig,
    cart_viscous_n_s_m=2.2,
    force_per_pwm_n=8.4,
    com_distance_m=0.0185,
    pole_inertia_kg_m2=0.0031,
    pole_viscous_n_m_s=0.0003,
)


def nothing(t: float, state: tuple, drive: float) -> float:
    return 0.0


def dry(v: float) -> float:
    return math.tanh(v / 2e-3)


def unlisted(on_cart: Push = nothing, on_pole: Push = nothing, seconds: float = 30.0) -> Recording:
    """Integrate the equations of motion here, with more on cart or pole, and record the run."""
    rig, h, sub = RIG, 1e-3, round(PERIOD_S / 1e-3)
    m, inertia, arm = (
        rig.total_mass_kg,
        rig.pole_inertia_kg_m2,
        rig.total_mass_kg * rig.com_distance_m,
    )

    def rates(t: float, y: tuple, drive: float) -> tuple[float, ...]:
        _, th, v, w = y
        force = (
            drive - rig.cart_viscous_n_s_m * v - arm * w**2 * math.sin(th) + on_cart(t, y, drive)
        )
        torque = (
            arm * rig.gravity_m_s2 * math.sin(th)
            - rig.pole_viscous_n_m_s * w
            + on_pole(t, y, drive)
        )
        k = arm * math.cos(th)
        return (
            v,
            w,
            (inertia * force + k * torque) / (m * inertia - k * k),
            (m * torque + k * force) / (m * inertia - k * k),
        )

    def moved(y: tuple, step: float, by: tuple) -> tuple:
        return tuple(a + step * b for a, b in zip(y, by, strict=True))

    n, y, states = round(seconds / PERIOD_S), (0.0, math.pi, 0.0, 0.0), []
    command = make_command(1, n)
    for k in range(n):
        states.append(y)
        drive = rig.force_per_pwm_n * command[k]
        for j in range(sub):
            t = (k * sub + j) * h
            k1 = rates(t, y, drive)
            k2 = rates(t + h / 2, moved(y, h / 2, k1), drive)
            k3 = rates(t + h / 2, moved(y, h / 2, k2), drive)
            k4 = rates(t + h, moved(y, h, k3), drive)
            y = moved(
                y,
                h / 6,
                tuple(a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)),
            )
    return Recording("unlisted", "sha256:1", as_measured(command, np.array(states)))


def as_measured(command: Floats, states: Floats) -> Signals:
    random, n = np.random.default_rng(1), len(command)
    cart = np.round((states[:, 0] + random.normal(0, 1e-5, n)) / CART_STEP_M) * CART_STEP_M
    pole = np.round((states[:, 1] + random.normal(0, 1e-4, n)) / POLE_STEP_RAD) * POLE_STEP_RAD
    return Signals(PERIOD_S, command, cart, pole, np.ones(n, bool), np.ones(n, bool))


def test_the_equations_here_are_those_of_the_twin() -> None:
    here = unlisted(seconds=20.0).signals
    twins = as_measured(here.command, made_states(Twin("rig", RIG), here.command))
    assert np.ptp(here.cart) > 0.1 and np.ptp(here.pole) > 1.0
    np.testing.assert_allclose(here.cart, twins.cart, atol=1.1 * CART_STEP_M)
    np.testing.assert_allclose(here.pole, twins.pole, atol=1.1 * POLE_STEP_RAD)


def gusts(t: float, y: tuple, drive: float) -> float:
    """Return a push that comes and goes, to either side, whatever the rig does."""
    return 2.0 * (-1) ** int(t / 3.7) if t % 3.7 > 2.9 else 0.0


def bump(t: float, y: tuple, drive: float) -> float:
    """Return a torque that repeats five times a turn."""
    return 0.01 * math.sin(5 * y[1])


@pytest.mark.parametrize(
    ("on_cart", "on_pole", "seconds"),
    [
        (gusts, nothing, 12.0),
        (nothing, bump, 14.0),
    ],
    ids=["gusts", "bump"],
)
def test_what_no_effect_explains_is_not_forced_onto_one(
    on_cart: Push, on_pole: Push, seconds: float
) -> None:
    found = diagnose([unlisted(on_cart, on_pole, seconds)], INTECO, silent).to_dict()
    assert_as_in_the_contract(found)
    assert found["outcome"] == "not_in_catalogue", found["sentence"]
    assert found["missing_physics"] == [] and found["masking"] == []
    assert found["location"] is not None
    rest = found["remainder"]  # measured laws may take all of it
    assert found["measured_laws"] or rest["above_noise_floor"] > 2


WIND = np.random.default_rng(4)
WAVES = list(zip(WIND.uniform(0.1, 2.0, 12), WIND.uniform(0.0, math.tau, 12), strict=True))


def wind(t: float, y: tuple, drive: float) -> float:
    """Return a push of many slow waves that never repeats, 0.29 N root mean square."""
    return 0.12 * sum(math.sin(math.tau * hertz * t + phase) for hertz, phase in WAVES)


@pytest.mark.long
def test_a_random_force_is_told_as_random_and_so_large() -> None:
    found = diagnose([unlisted(wind, seconds=40.0)], INTECO, silent).to_dict()
    assert found["outcome"] == "not_in_catalogue" and found["missing_physics"] == []
    assert found["measured_laws"] == []
    wandering = found["remainder"]["wandering"]
    assert wandering["force_n"] == pytest.approx(0.12 * math.sqrt(6), rel=0.25)
    assert 0.1 < wandering["correlation_s"] < 1.0
    assert wandering["random_share"] > 0.5
    assert "of it depends on nothing that was asked, and may be random." in found["sentence"]


def one_sided(t: float, y: tuple, drive: float) -> float:
    """Return dry friction on one half of the rail, beside a strong force of the position."""
    return (-0.8 * dry(y[2]) if y[0] > 0 else 0.0) - 4.0 * math.sin(9 * y[0]) * y[0]


@pytest.mark.long
def test_what_two_unlisted_forces_leave_is_told() -> None:
    found = diagnose([unlisted(one_sided, seconds=20.0)], INTECO, silent).to_dict()
    assert found["outcome"] != "nothing_missing"
    assert found["remainder"]["above_noise_floor"] > 2 and found["remainder"]["place"] == "cart"


def test_the_improved_twin_is_one_that_can_be_read_back(friction: tuple[dict, Findings]) -> None:
    _, kept = friction
    twin: Twin = kept.best.twin
    assert parse_twin(twin.to_mapping()) == twin

"""A reset ends at rest in the middle before its deadline, or says why not."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.guarded_rigs import PERIOD_S, reset_run, seen, settled, stepper, varied

from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.events import begin_reset
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.reset import (
    LONGEST_STEP_S,
    Reset,
    Rest,
    find_end,
    find_obstacle,
    is_at_rest,
    is_zero_wrong,
    let_time_pass,
    make_swing_down,
    swing_on,
)
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import make_rules
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import POLE_KEYS, Rig

REST = Rest()
HANGING = RigState(0.0, math.pi, 0.0, 0.0)
HINDRANCES = {
    "nothing": {},
    "delay": {"input_delay": {"delay_s": 0.02}},
    "lag": {"motor_lag": {"time_constant_s": 0.04}},
    "dry friction": {"cart_coulomb_friction": {"level_n": 0.5}},
    "much dry friction": {"cart_coulomb_friction": {"level_n": 1.2}},
    "tilt": {"rail_tilt": {"angle_rad": 0.03}},
    "tilt and friction": {
        "rail_tilt": {"angle_rad": -0.03},
        "cart_coulomb_friction": {"level_n": 0.6},
    },
    "the thesis's friction": {
        "cart_saturating_friction": {"viscous_n_s_m": 1.2, "level_n": 0.5, "limit_n": 1.0}
    },
    "dead zone": {"input_dead_zone": {"width": 0.02}},
    "wide dead zone and friction": {
        "input_dead_zone": {"width": 0.04},
        "cart_coulomb_friction": {"level_n": 0.5},
    },
    "sticky pole": {"pole_coulomb_friction": {"level_n_m": 0.002}},
}


@pytest.mark.long
@pytest.mark.parametrize("hindrance", HINDRANCES)
def test_random_rigs_come_to_rest_from_anywhere(hindrance: str, nominal: Rig) -> None:
    rules = make_rules(nominal)
    for seed in range(16):
        random = np.random.default_rng(seed)
        start = (*random.uniform((-0.6, -30, -0.5, -20), (0.6, 30, 0.5, 20)).tolist(),)
        rig = stepper(varied(nominal, random), HINDRANCES[hindrance], start)
        decision, seconds, furthest = reset_run(rig, rules)
        assert decision.reset_ended is Reason.RESET_DONE, f"seed {seed}"
        assert seconds < rules.swing.deadline_s and furthest < 0.85
        assert is_at_rest(seen(rig), REST) and decision.pwm == 0.0


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.6, 0.6), st.floats(-60, 60), st.floats(-0.5, 0.5), st.floats(-20, 20))
@example(0.0, math.pi, 0.0, 0.0)
@example(0.5, 1e-3, 0.0, 0.0)  # standing upright
@example(0.0, math.pi, 0.0, 20.0)  # spinning
def test_the_nominal_rig_comes_to_rest_from_anywhere(
    nominal: Rig, x: float, th: float, v: float, w: float
) -> None:
    if abs(math.remainder(th, 2 * math.pi)) < 1e-4 and abs(w) < 1e-3:
        return  # balanced for longer than a zero is believed
    decision, seconds, furthest = reset_run(
        stepper(nominal, {}, (x, th, v, w)), make_rules(nominal)
    )
    assert decision.reset_ended is Reason.RESET_DONE
    assert seconds < 12 and furthest < 0.85


def test_it_is_done_only_after_several_samples_at_rest() -> None:
    plan, reset = make_swing_down(Rig(0.5, 0.1, 0.02, 0.003, 9.81, 12.0, 0.5, 2e-4), 0.5), Reset()
    for sample in range(REST.samples - 1):
        reset = swing_on(reset, HANGING, 0.0, PERIOD_S, plan)
        assert find_end(reset, plan) is None and reset.at_rest == sample + 1
    shaken = swing_on(reset, replace(HANGING, pole_rad_s=0.5), 0.0, PERIOD_S, plan)
    assert shaken.at_rest == 0
    assert find_end(swing_on(reset, HANGING, 0.0, PERIOD_S, plan), plan) is Reason.RESET_DONE


@pytest.mark.parametrize(
    ("state", "rests"),
    [
        (HANGING, True),
        (replace(HANGING, pole_rad=-math.pi), True),
        (replace(HANGING, pole_rad=7 * math.pi + 0.02), True),
        (replace(HANGING, pole_rad=0.0), False),
        (replace(HANGING, pole_rad=2 * math.pi), False),
        (replace(HANGING, cart_m=0.03), False),
        (replace(HANGING, cart_m_s=-0.03), False),
        (replace(HANGING, pole_rad_s=0.2), False),
        (replace(HANGING, pole_rad=math.pi + 0.04), False),
    ],
)
def test_each_of_the_four_numbers_counts(state: RigState, rests: bool) -> None:
    assert is_at_rest(state, REST) is rests


def test_a_wrong_zero_is_found_and_nothing_is_moved_meanwhile(nominal: Rig) -> None:
    """Hanging reads 0, so that damping the pole would drive it; the cart is not in the middle."""
    rules, reading = make_rules(nominal), RigState(0.3, 0.0, 0.0, 0.0)
    safety, _ = begin_reset(0.0, settled(rules, reading), rules)
    for k in range(1, 1000):
        decision = decide(None, reading, k * PERIOD_S, safety, rules)
        safety = decision.safety
        assert decision.pwm == 0.0
        if decision.reset_ended:
            break
    assert decision.reset_ended is Reason.ZERO_WRONG and k * PERIOD_S == pytest.approx(
        REST.standing_s, abs=0.05
    )
    assert "zero it while the pole hangs still" in Reason.ZERO_WRONG.sentence
    assert is_zero_wrong(replace(HANGING, pole_rad=math.pi + 0.1), REST) and not is_zero_wrong(
        HANGING, REST
    )


@pytest.mark.parametrize("field", [0.0, 2.0, math.pi])
def test_a_rig_without_a_pole_is_reset_whatever_its_pole_field_holds(
    field: float, nominal: Rig
) -> None:
    cart = replace(nominal, **dict.fromkeys(POLE_KEYS))
    rig = stepper(cart, {"cart_coulomb_friction": {"level_n": 0.5}}, (0.4, field, 0.3, 0.0))
    decision, _, furthest = reset_run(rig, make_rules(cart))
    assert decision.reset_ended is Reason.RESET_DONE and furthest < 0.85
    assert abs(rig.state[0]) <= REST.cart_m and abs(rig.state[2]) <= REST.cart_m_s


def test_a_pole_that_a_rig_does_not_have_is_not_damped(nominal: Rig) -> None:
    plan = make_swing_down(replace(nominal, **dict.fromkeys(POLE_KEYS)), 0.5)
    away = replace(HANGING, cart_m=0.3)
    still, wild = (
        swing_on(Reset(), replace(away, pole_rad_s=rate), 0.0, PERIOD_S, plan)
        for rate in (0.0, 9.0)
    )
    assert still == wild and still.pwm != 0.0


@pytest.mark.parametrize(("applied", "shows"), [(0.02, False), (-0.02, False), (0.2, True)])
def test_a_command_that_the_dead_zone_swallows_shows_no_width(
    nominal: Rig, applied: float, shows: bool
) -> None:
    plan = make_swing_down(nominal, 0.5)
    rolling = replace(HANGING, cart_m=0.3, cart_m_s=0.4)
    reset = swing_on(Reset(cart_m_s=0.4, dead=0.05), rolling, applied, PERIOD_S, plan)
    assert (reset.dead != 0.05) is shows


def test_a_gap_between_samples_counts_for_a_short_while_alone(nominal: Rig) -> None:
    """Nobody knows whether cart and pole stood all the time between two samples."""
    plan = make_swing_down(nominal, 0.5)
    off_zero, stuck = replace(HANGING, pole_rad=0.0), replace(HANGING, pole_rad_s=5.0)
    for still in (off_zero, stuck):
        usual, late = (
            swing_on(Reset(cart_m_s=0.0), still, 0.0, gap_s, plan)
            for gap_s in (LONGEST_STEP_S, 0.4)
        )
        assert late == usual and late.standing_s + late.dry > 0.0


def test_it_never_goes_on_beyond_its_deadline(nominal: Rig) -> None:
    plan = make_swing_down(nominal, 0.5, deadline_s=3.0)
    reset, swinging = Reset(), replace(HANGING, pole_rad_s=5.0)
    for _ in range(299):
        reset = let_time_pass(swing_on(reset, swinging, 0.0, PERIOD_S, plan), PERIOD_S)
        assert find_end(reset, plan) is None
    assert find_end(let_time_pass(reset, 0.02), plan) is Reason.RESET_LATE


def test_it_refuses_to_begin_with_the_reason() -> None:
    assert find_obstacle(Reason.RIG_SILENT, stopped=False) is Reason.RESET_SILENT
    assert (
        find_obstacle(None, stopped=True)
        is find_obstacle(Reason.RIG_SILENT, stopped=True)
        is Reason.RESET_STOPPED
    )
    assert find_obstacle(None, stopped=False) is None


def test_an_inverted_drive_is_driven_the_other_way(nominal: Rig) -> None:
    away = replace(HANGING, cart_m=0.3, cart_m_s=0.2, pole_rad_s=1.0)
    first, second = (
        swing_on(Reset(), away, 0.0, PERIOD_S, make_swing_down(nominal, 0.5, way=way)).pwm
        for way in (1, -1)
    )
    assert first == -second != 0.0


@pytest.mark.parametrize(
    ("effect", "way", "pole_way"),
    [
        ("input_sign_inverted", -1, 1),
        ("cart_sign_inverted", -1, -1),
        ("angle_sign_inverted", 1, -1),
    ],
)
def test_with_its_signs_told_a_mirrored_rig_comes_to_rest(
    effect: str, way: int, pole_way: int, nominal: Rig
) -> None:
    rig = stepper(nominal, {effect: {}}, (0.4, 2.0, 0.0, 12.0))
    decision, _, furthest = reset_run(rig, make_rules(nominal, way=way, pole_way=pole_way))
    assert decision.reset_ended is Reason.RESET_DONE and furthest < 0.85


@pytest.mark.parametrize("deadline_s", [0.0, math.nan, math.inf])
def test_a_deadline_that_is_none_is_refused(nominal: Rig, deadline_s: float) -> None:
    with pytest.raises(
        BadInputError, match="reset deadline: expected a number of seconds above 0"
    ):
        make_swing_down(nominal, 0.5, deadline_s=deadline_s)

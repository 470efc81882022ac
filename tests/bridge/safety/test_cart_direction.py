"""The rail guard goes by the cart's motion where the twin file gives the wrong direction."""

import math

import numpy as np
import pytest
from support.guarded_rigs import PERIOD_S, settled, stepper, varied

from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.events import begin_reset, take_command
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.signs import find_ways
from pendulum_bridge.safety.state import Rules, Safety, make_rules
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

LIMIT, MARGIN_M = 0.5, 0.05
MIRRORED = ("cart_sign_inverted", "input_sign_inverted")
HANGING = (0.0, math.pi, 0.0, 0.0)


@pytest.fixture(scope="module")
def rules(nominal: Rig) -> Rules:
    return make_rules(nominal, Limits(LIMIT, 50.0))


def show(rig: Stepper, effect: str) -> RigState:
    """Return what a mirrored rig reports."""
    x, th, v, w = rig.state.tolist()
    sign = -1 if effect == "cart_sign_inverted" else 1
    return RigState(sign * x, th, sign * v, w)


def drive(
    rig: Stepper, effect: str, commands: list[float], rules: Rules, safety: Safety | None = None
) -> tuple[Safety, float]:
    """Return the state after the commands, and how far from the middle the cart came, m."""
    safety = safety or settled(rules, show(rig, effect))
    sign, far = -1 if effect == "input_sign_inverted" else 1, 0.0
    for command in commands:
        now_s = safety.ages.now_s + PERIOD_S
        safety, _ = take_command(command, safety)
        decision = decide(None, show(rig, effect), now_s, safety, rules)
        safety = decision.safety
        far = max(far, abs(float(rig.step(sign * decision.pwm)[0])))
    return safety, far


def draw_pushes(random: np.random.Generator, pushes: int) -> list[float]:
    """Return pushes of random sizes, both ways in turn, of 0.3 to 0.6 s."""
    sides = random.choice([-1, 1]) * (-1) ** np.arange(pushes)
    sizes, counts = random.uniform(0.1, LIMIT, pushes), random.integers(30, 60, pushes)
    return np.repeat(sides * sizes, counts).tolist()


@pytest.mark.parametrize("effect", MIRRORED)
def test_a_mirrored_rig_is_noticed_and_kept_on_the_rail(
    nominal: Rig, rules: Rules, effect: str
) -> None:
    """After a few pushes no command drives the cart beyond the guard's margin."""
    for seed in range(10):
        random = np.random.default_rng(seed)
        rig = stepper(varied(nominal, random), {}, HANGING)
        safety, _ = drive(rig, effect, draw_pushes(random, 8), rules)
        assert safety.direction.turned, seed
        outwards = [math.copysign(LIMIT, 350 - k % 700) for k in range(1400)]
        safety, far = drive(rig, effect, outwards, rules, safety)
        assert far < nominal.rail_half_length_m - MARGIN_M, seed


@pytest.mark.parametrize("effect", MIRRORED)
def test_the_mirrored_rig_is_named_for_a_person(nominal: Rig, rules: Rules, effect: str) -> None:
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, effect, [0.3] * 40 + [-0.3] * 40, rules)
    decision = decide(0.0, show(rig, effect), safety.ages.now_s + PERIOD_S, safety, rules)
    assert Reason.CART_MIRRORED in decision.reasons and decision.level is Level.WARN


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"input_delay": {"delay_s": 0.04}},
        {"motor_lag": {"time_constant_s": 0.03}},
        {"cart_coulomb_friction": {"level_n": 3.0}},
        {"rail_tilt": {"angle_rad": 0.03}},
    ],
)
def test_no_command_turns_the_direction_of_a_rig_that_is_as_told(
    nominal: Rig, rules: Rules, effects: dict
) -> None:
    """With a delay, dry friction, a tilted rail, a pole that whirls at up to 20 rad/s."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        start = (0.0, math.pi + random.uniform(-3, 3), 0.0, random.uniform(-20, 20))
        rig = stepper(varied(nominal, random), effects, start)
        kind = ("pushes", "noise", "tones")[seed % 3]
        commands = {
            "pushes": draw_pushes(random, 40)[:1500],
            "noise": random.uniform(-LIMIT, LIMIT, 1500).tolist(),
            "tones": (LIMIT * np.sin(2 * np.pi * (0.3 + 3 * np.arange(1500) / 1500) ** 2 * 7.5)),
        }[kind]
        safety, _ = drive(rig, "", list(map(float, commands)), rules)
        assert not safety.direction.turned, (seed, kind)


def test_friction_that_stops_a_sliding_cart_is_no_vote(nominal: Rig, rules: Rules) -> None:
    """The cart slides out of a hard push into a weak one, which dry friction outweighs."""
    rig = stepper(nominal, {"cart_coulomb_friction": {"level_n": 2.5}}, HANGING)
    pattern = [0.4] * 15 + [0.1] * 25 + [-0.4] * 15 + [-0.1] * 25
    safety, _ = drive(rig, "", pattern * 12, rules)
    assert not safety.direction.turned


def test_a_turned_direction_turns_back(nominal: Rig, rules: Rules) -> None:
    """A hand moves the cart against the drive; afterwards the drive moves the cart."""
    safety = settled(rules, RigState(*HANGING))
    for k in range(60):
        by_hand = RigState(-0.004 * k, math.pi, -0.025 * k, 0.0)
        safety, _ = take_command(0.2, safety)
        safety = decide(None, by_hand, safety.ages.now_s + PERIOD_S, safety, rules).safety
    assert safety.direction.turned
    rig = stepper(nominal, {}, (by_hand.cart_m, by_hand.pole_rad, by_hand.cart_m_s, 0.0))
    safety, _ = drive(rig, "", [0.2] * 80 + [-0.2] * 80, rules, safety)
    assert not safety.direction.turned


def test_the_reset_goes_by_the_motion_too(nominal: Rig, rules: Rules) -> None:
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, "cart_sign_inverted", [0.3] * 40 + [-0.3] * 40, rules)
    assert safety.direction.turned and abs(rig.state[0]) > rules.swing.rest.cart_m
    safety, reason = begin_reset(safety.ages.now_s, safety, rules)
    assert reason is Reason.RESETTING
    while safety.reset:
        now_s = safety.ages.now_s + PERIOD_S
        decision = decide(None, show(rig, "cart_sign_inverted"), now_s, safety, rules)
        safety = decision.safety
        rig.step(decision.pwm)
    assert abs(rig.state[0]) < 2 * rules.swing.rest.cart_m


@pytest.mark.parametrize("mirrored", MIRRORED)
def test_a_twin_file_that_names_the_mirror_is_right_from_the_start(
    nominal: Rig, mirrored: str
) -> None:
    way, pole_way = find_ways({mirrored})
    rules = make_rules(nominal, Limits(LIMIT, 50.0), way=way, pole_way=pole_way)
    random = np.random.default_rng(0)
    safety, far = drive(stepper(nominal, {}, HANGING), mirrored, draw_pushes(random, 40), rules)
    assert not safety.direction.turned
    assert far < nominal.rail_half_length_m - MARGIN_M

"""The rail guard goes by the cart's motion where the twin file gives the wrong direction."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pytest
from support.guarded_rigs import PERIOD_S, settled, stepper, varied

from pendulum_bridge.safety.cart_direction import CartDirection, follow_cart
from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.events import (
    activate,
    begin_reset,
    change_rules,
    clear_stop,
    deactivate,
    press_stop,
    take_command,
)
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.signs import find_ways
from pendulum_bridge.safety.state import Rules, Safety, make_rules
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

LIMIT, MARGIN_M = 0.5, 0.05
THERE_AND_BACK = [0.3] * 25 + [-0.3] * 50 + [0.3] * 20  # the cart gains speed both ways
CART_KG = 0.7  # cart and pole, about
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
    rig: Stepper,
    effect: str,
    commands: Iterable[float | Callable[[RigState], float]],
    rules: Rules,
    safety: Safety | None = None,
    hand_n: float = 0.0,
) -> tuple[Safety, float]:
    """Return the state after the commands, and how far from the middle the cart came, m.

    commands: PWM fractions, or a controller's.
    hand_n: N; force of a hand on the cart.
    """
    safety = safety or settled(rules, show(rig, effect))
    sign, far = -1 if effect == "input_sign_inverted" else 1, 0.0
    gained_m_s = hand_n / CART_KG * PERIOD_S
    for command in commands:
        now_s, seen = safety.ages.now_s + PERIOD_S, show(rig, effect)
        safety, _ = take_command(command(seen) if callable(command) else command, safety)
        decision = decide(None, seen, now_s, safety, rules)
        safety = decision.safety
        x, th, v, w = rig.step(sign * decision.pwm).tolist()
        if hand_n:
            rig.reset((x, th, v + gained_m_s, w), before=sign * decision.pwm)
        far = max(far, abs(x))
    return safety, far


def draw_pushes(random: np.random.Generator, pushes: int) -> list[float]:
    """Return pushes of random sizes, both ways in turn, of 0.3 to 0.6 s; the first is half."""
    sides = random.choice([-1, 1]) * (-1) ** np.arange(pushes)
    size, counts = random.uniform(0.2, LIMIT), random.integers(30, 60, pushes)
    counts[0] //= 2
    return np.repeat(sides * size * random.uniform(0.8, 1.0, pushes), counts).tolist()


@pytest.mark.parametrize("effect", MIRRORED)
def test_a_mirrored_rig_is_noticed_and_kept_on_the_rail(
    nominal: Rig, rules: Rules, effect: str
) -> None:
    """After a few pushes no command drives the cart beyond the guard's margin."""
    for seed in range(10):
        random = np.random.default_rng(seed)
        rig = stepper(varied(nominal, random), {}, HANGING)
        safety, _ = drive(rig, effect, draw_pushes(random, 16), rules)
        assert safety.direction.turned, seed
        outwards = [math.copysign(LIMIT, 350 - k % 700) for k in range(1400)]
        safety, far = drive(rig, effect, outwards, rules, safety)
        assert far < nominal.rail_half_length_m - MARGIN_M, seed


@pytest.mark.parametrize("effect", MIRRORED)
def test_the_mirrored_rig_is_named_for_a_person(nominal: Rig, rules: Rules, effect: str) -> None:
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, effect, THERE_AND_BACK, rules)
    decision = decide(0.0, show(rig, effect), safety.ages.now_s + PERIOD_S, safety, rules)
    assert Reason.CART_MIRRORED in decision.reasons and decision.level is Level.WARN


@pytest.mark.long
@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"input_delay": {"delay_s": 0.04}},
        {"input_delay": {"delay_s": 0.1}},
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
        safety = settled(rules, show(rig, ""))
        for command in map(float, commands):
            safety, _ = drive(rig, "", [command], rules, safety)
            assert not safety.direction.turned, (seed, kind)


def test_friction_that_stops_a_sliding_cart_is_no_vote(nominal: Rig, rules: Rules) -> None:
    """The cart slides out of a hard push into a weak one, which dry friction outweighs."""
    rig = stepper(nominal, {"cart_coulomb_friction": {"level_n": 2.5}}, HANGING)
    pattern = [0.4] * 15 + [0.1] * 25 + [-0.4] * 15 + [-0.1] * 25
    safety, _ = drive(rig, "", pattern * 12, rules)
    assert not safety.direction.turned


def test_a_gain_of_speed_is_a_vote_of_its_own_stretch_alone(rules: Rules) -> None:
    """A cart that was pushed back once and rolls on gives no more votes."""
    direction, speed = CartDirection(), 0.0
    for _ in range(100):
        if not sum(direction.votes):
            speed -= 0.03
        sample = RigState(0.0, math.pi, speed, 0.0)
        direction = follow_cart(direction, sample, 0.3, PERIOD_S, PERIOD_S, rules.guard)
    assert direction.against and direction.votes == (0, 1)


def test_no_stretch_goes_on_through_a_gap_between_samples(rules: Rules) -> None:
    """Nobody knows what acted meanwhile on a cart that gains speed against its push."""
    for gap_periods, known in ((5, True), (6, False)):
        direction = CartDirection()
        for k in range(60):
            gap_s = (gap_periods if k % 10 == 0 else 1) * PERIOD_S
            sample = RigState(0.0, math.pi, -0.03 * k, 0.0)
            direction = follow_cart(direction, sample, 0.3, gap_s, PERIOD_S, rules.guard)
        assert (sum(direction.votes) > 0) is known


@pytest.mark.parametrize("known", [True, False], ids=["after pushes", "before any push"])
@pytest.mark.parametrize(
    ("limit", "hand_n", "seconds", "hold_m"),
    [(0.2, 6.0, 0.3, 0.4), (0.3, 10.0, 0.3, 0.0), (0.5, 12.0, 0.2, 0.4)],
)
def test_a_hand_does_not_turn_a_rig_that_is_as_told(
    nominal: Rig,
    rules: Rules,
    known: bool,
    limit: float,
    hand_n: float,
    seconds: float,
    hold_m: float,
) -> None:
    """A controller holds the cart, and pushes against the hand that shoves it outwards.

    Before any push has shown the direction, the shove leaves it in doubt, and PWM 0 brakes not.
    """
    rig = stepper(nominal, {}, (hold_m, math.pi, 0.0, 0.0))
    safety = settled(rules, show(rig, ""))

    def hold(seen: RigState) -> float:
        wanted = 3.0 * (hold_m - seen.cart_m) - 0.6 * seen.cart_m_s
        return min(max(wanted, -limit), limit)

    if known:
        safety, _ = drive(rig, "", THERE_AND_BACK, rules, safety)
        assert safety.direction.decided and not safety.direction.turned
    for _ in range(3):
        safety, _ = drive(rig, "", [hold] * 300, rules, safety)
        safety, _ = drive(rig, "", [hold] * round(seconds / PERIOD_S), rules, safety, hand_n)
        assert not safety.direction.turned
    safety, far = drive(rig, "", [hold] * 300, rules, safety)
    assert not safety.direction.turned and (not known or far < nominal.rail_half_length_m)


@pytest.mark.parametrize("effect", MIRRORED)
def test_a_mirrored_cart_that_is_jogged_one_way_is_not_driven_to_the_end(
    nominal: Rig, rules: Rules, effect: str
) -> None:
    """Pushes of one sign leave the direction in doubt: near the end PWM is 0."""
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, effect, [0.08] * 120, rules)
    assert safety.direction.in_doubt and not safety.direction.turned
    reasons = set()
    for _ in range(300):
        now_s = safety.ages.now_s + PERIOD_S
        safety, _ = take_command(0.08, safety)
        decision = decide(None, show(rig, effect), now_s, safety, rules)
        safety, reasons = decision.safety, {*reasons, *decision.reasons}
        assert decision.pwm in (0.0, pytest.approx(0.08))
        if Reason.CART_DOUBTED in decision.reasons:
            assert decision.pwm == 0.0
            break
        rig.step(-decision.pwm if effect == "input_sign_inverted" else decision.pwm)
    assert Reason.CART_DOUBTED in reasons


def test_what_a_person_may_have_changed_is_found_anew(nominal: Rig, rules: Rules) -> None:
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, "cart_sign_inverted", THERE_AND_BACK, rules)
    assert safety.direction.turned
    corrected = make_rules(nominal, Limits(LIMIT, 50.0), way=-1, pole_way=-1)
    assert not change_rules(safety, rules, corrected).direction.turned
    assert change_rules(safety, rules, replace(rules, period_s=0.02)).direction.turned
    assert not activate(deactivate(safety)[0], safety.ages.now_s).direction.turned
    stopped, _ = press_stop(safety)
    assert stopped.direction.turned
    zero = take_command(0.0, stopped)[0]
    cleared, reason = clear_stop(zero, rules)
    assert reason is Reason.STOP_CLEARED and not cleared.direction.turned


def test_a_push_between_two_samples_ends_the_push_before(nominal: Rig, rules: Rules) -> None:
    """The command that a sample finds acted for a tenth of the period alone."""
    rig = stepper(nominal, {}, HANGING)
    safety = settled(rules, show(rig, ""))
    for _ in range(150):
        now_s = safety.ages.now_s
        for command, at_s in ((0.25, 0.001), (-0.06, 0.009)):
            safety, _ = take_command(command, safety)
            safety = decide(None, None, now_s + at_s, safety, rules).safety
        rig.step(0.25)
        safety = decide(None, show(rig, ""), now_s + PERIOD_S, safety, rules).safety
        assert not safety.direction.turned


def test_a_driver_that_is_behind_counts_no_time_twice(nominal: Rig) -> None:
    """A delay of 60 ms, 1000 Hz, and a decision on each fifth sample."""
    rules = make_rules(nominal, Limits(LIMIT, 50.0), period_s=0.001)
    rig = stepper(nominal, {"input_delay": {"delay_s": 0.06}}, HANGING)
    for hz in (3.0, 4.0, 6.0):
        safety = settled(rules, show(rig, ""))
        for k in range(1000):
            now_s = safety.ages.now_s + 0.005
            safety, _ = take_command(math.copysign(0.4, math.sin(2 * np.pi * hz * now_s)), safety)
            decision = decide(None, show(rig, ""), now_s, safety, rules, skipped=4)
            safety = decision.safety
            if k % 2:
                rig.step(decision.pwm)
            assert not safety.direction.turned, hz


def test_the_reset_brings_a_mirrored_cart_to_the_middle(nominal: Rig, rules: Rules) -> None:
    """The pole, which is left to itself, does not come to rest in time."""
    rig = stepper(nominal, {}, HANGING)
    safety, _ = drive(rig, "cart_sign_inverted", THERE_AND_BACK, rules)
    assert safety.direction.turned and abs(rig.state[0]) > rules.swing.rest.cart_m
    safety, reason = begin_reset(safety.ages.now_s, safety, rules)
    assert reason is Reason.RESETTING
    while safety.reset:
        now_s = safety.ages.now_s + PERIOD_S
        decision = decide(None, show(rig, "cart_sign_inverted"), now_s, safety, rules)
        safety = decision.safety
        rig.step(decision.pwm)
    assert decision.reset_ended in (Reason.RESET_DONE, Reason.RESET_LATE)
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

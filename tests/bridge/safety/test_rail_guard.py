"""No commands drive the cart beyond the margin before the end of the rail, on any similar rig."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.guarded_rigs import PERIOD_S, seen, stepper, varied
from support.paths import CONFIG

from pendulum_bridge.safety.rail_guard import (
    Seen,
    compute_braking_distance,
    find_outermost,
    guard_command,
    make_rail_guard,
)
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

MARGIN_M, LIMIT = 0.05, 0.5
SLOW_DRIVES = ({}, {"input_delay": {"delay_s": 0.02}}, {"motor_lag": {"time_constant_s": 0.015}})


def draw_command(
    kind: str, random: np.random.Generator, k: int, rig: Stepper, last: float
) -> float:
    """Return the next command of an adversary."""
    x, th, v, w = rig.state.tolist()
    return {
        "out": math.copysign(9.0, 350 - k % 700),
        "telegraph": float(random.choice([-LIMIT, 0.0, LIMIT]))
        if random.random() < 0.03
        else last,
        "pump": math.copysign(LIMIT, math.cos(th) * w),  # as much energy into the pole as can be
        "run on": math.copysign(LIMIT, v),
        "nearest end": math.copysign(LIMIT, x),
        "noise": float(random.uniform(-1, 1)),
    }[kind]


ADVERSARIES = ("out", "telegraph", "pump", "run on", "nearest end", "noise")


def find_furthest(
    rig: Stepper,
    nominal: Rig,
    kind: str,
    random: np.random.Generator,
    samples: int,
    lost: float = 0.0,
) -> float:
    """Return how far from the middle an adversary brings the cart; lost: share of lost samples."""
    guard = make_rail_guard(nominal, LIMIT, MARGIN_M)
    command, applied, in_vain_s, far, age = LIMIT, 0.0, 0.0, 0.0, 0.0
    shown = seen(rig)
    for k in range(samples):
        shown, age = (shown, age + PERIOD_S) if random.random() < lost else (seen(rig), 0.0)
        command = draw_command(kind, random, k, rig, command)
        within = min(max(command, -LIMIT), LIMIT)
        guarded = guard_command(within, Seen(shown, age, applied), in_vain_s, PERIOD_S, guard)
        assert abs(guarded.pwm) <= LIMIT and guarded.reason is not Reason.RAIL_NOT_HELD
        applied, in_vain_s = guarded.pwm, guarded.in_vain_s
        far = max(far, abs(float(rig.step(applied)[0])))
    return far


@pytest.mark.parametrize("kind", ADVERSARIES)
def test_no_adversary_passes_the_margin(kind: str, nominal: Rig) -> None:
    """Over 60 seeds of 15 s each: at worst 4.7 mm inside the margin; poles reach 190 rad/s."""
    for seed in range(24):
        random = np.random.default_rng(seed)
        start = (
            random.uniform(-0.5, 0.5),
            math.pi + random.uniform(-3, 3),
            0.0,
            random.uniform(-15, 15),
        )
        rig = stepper(varied(nominal, random, corner=seed % 2 == 0), SLOW_DRIVES[seed % 3], start)
        assert (
            find_furthest(rig, nominal, kind, random, 1000) < nominal.rail_half_length_m - MARGIN_M
        )


def test_nor_when_every_second_sample_is_lost(nominal: Rig) -> None:
    for seed in range(12):
        random = np.random.default_rng(seed)
        rig = stepper(varied(nominal, random), {}, (0.0, math.pi, 0.0, random.uniform(-15, 15)))
        kind = ADVERSARIES[seed % len(ADVERSARIES)]
        assert (
            find_furthest(rig, nominal, kind, random, 1000, lost=0.5)
            < nominal.rail_half_length_m - MARGIN_M
        )


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-LIMIT, LIMIT), st.integers(1, 60)), max_size=12),
    st.integers(0, 10**6),
)
def test_nor_does_any_sequence_of_commands(
    nominal: Rig, plan: list[tuple[float, int]], seed: int
) -> None:
    random = np.random.default_rng(seed)
    guard = make_rail_guard(nominal, LIMIT, MARGIN_M)
    rig = stepper(
        varied(nominal, random, corner=True), SLOW_DRIVES[seed % 3], (0.0, math.pi, 0.0, 0.0)
    )
    applied = 0.0
    for command in (command for command, samples in plan for _ in range(samples)):
        applied = guard_command(command, Seen(seen(rig), 0.0, applied), 0.0, PERIOD_S, guard).pwm
        assert abs(rig.step(applied)[0]) < nominal.rail_half_length_m - MARGIN_M


def test_a_quiet_cart_in_the_middle_is_left_alone(nominal: Rig) -> None:
    guard = make_rail_guard(nominal, LIMIT)
    for command in (-0.5, 0.0, 0.3):
        guarded = guard_command(
            command, Seen(RigState(0.2, math.pi, 0.1, 0.0), 0.0, command), 0.0, PERIOD_S, guard
        )
        assert guarded.pwm == command and guarded.reason is None


def test_braking_distance_has_its_closed_forms(nominal: Rig) -> None:
    """Without friction v^2/2b; with it shorter, and as an integration in small steps has it."""
    guard = replace(make_rail_guard(nominal, LIMIT), friction_1_s=0.0)
    brake = guard.brake_m_s2 * LIMIT
    assert compute_braking_distance(2.0, guard) == pytest.approx(4 / (2 * brake))
    assert compute_braking_distance(-1.0, guard) == 0.0
    rough = replace(guard, friction_1_s=0.7)
    v, x, h = 2.0, 0.0, 1e-5
    while v > 0:
        x, v = x + v * h, v - (brake + 0.7 * v) * h
    assert compute_braking_distance(2.0, rough) == pytest.approx(x, rel=1e-3)


@given(st.floats(0, 5), st.floats(0, 1))
def test_braking_distance_grows_with_speed(speed: float, more: float) -> None:
    guard = make_rail_guard(Rig(0.5, 0.1, 0.02, 0.003, 9.81, 12.0, 0.5, 2e-4, 0.9), LIMIT)
    slower_m = compute_braking_distance(speed, guard)
    assert compute_braking_distance(speed + more, guard) >= slower_m - 1e-12


def test_a_cart_beyond_is_sent_back_gently_and_a_running_one_is_braked_fully(nominal: Rig) -> None:
    guard = make_rail_guard(nominal, LIMIT)
    resting = guard_command(
        0.5, Seen(RigState(-0.88, math.pi, 0.0, 0.0), 0.0, 0.0), 0.0, PERIOD_S, guard
    )
    running = guard_command(
        -0.5, Seen(RigState(-0.8, math.pi, -2.0, 0.0), 0.0, 0.0), 0.0, PERIOD_S, guard
    )
    assert resting.pwm == 0.5  # asked for the right way: that may be stronger
    assert guard_command(
        -0.5, Seen(RigState(-0.88, math.pi, 0.0, 0.0), 0.0, 0.0), 0.0, PERIOD_S, guard
    ).pwm == pytest.approx(0.15)
    assert running.pwm == LIMIT and running.reason is Reason.RAIL_BRAKING


@pytest.mark.parametrize(("back_m_s", "pwm"), [(0.1, -0.15), (0.3, 0.0)])
def test_a_cart_that_comes_back_fast_enough_is_pushed_no_more(
    nominal: Rig, back_m_s: float, pwm: float
) -> None:
    """So far beyond the margin that even the full brake comes too late."""
    guard = make_rail_guard(nominal, LIMIT)
    coming = Seen(RigState(1.5, math.pi, -back_m_s, 0.0), 0.0, 0.0)
    assert guard_command(LIMIT, coming, 0.0, PERIOD_S, guard).pwm == pytest.approx(pwm)


def test_both_ends_and_both_ways_are_mirrored(nominal: Rig) -> None:
    guard, other = make_rail_guard(nominal, LIMIT), make_rail_guard(nominal, LIMIT, way=-1)
    for x, v, command in ((0.7, 0.8, 0.4), (0.6, 1.5, -0.1), (0.2, 2.5, 0.5)):
        here = guard_command(
            command, Seen(RigState(x, math.pi, v, 0.0), 0.0, 0.2), 0.0, PERIOD_S, guard
        ).pwm
        there = guard_command(
            -command, Seen(RigState(-x, math.pi, -v, 0.0), 0.0, -0.2), 0.0, PERIOD_S, guard
        ).pwm
        inverted = guard_command(
            -command, Seen(RigState(x, math.pi, v, 0.0), 0.0, -0.2), 0.0, PERIOD_S, other
        ).pwm
        assert here == pytest.approx(-there) == pytest.approx(-inverted)


def test_a_drive_that_goes_the_wrong_way_is_switched_off(nominal: Rig) -> None:
    """A stuck cart, or a cart whose command has the other sign, is not pushed for ever."""
    guard, in_vain_s = make_rail_guard(nominal, LIMIT), 0.0
    at_the_end = Seen(RigState(0.9, math.pi, 0.0, 0.0), 0.0, 0.0)
    for _ in range(102):
        guarded = guard_command(0.1, at_the_end, in_vain_s, PERIOD_S, guard)
        in_vain_s = guarded.in_vain_s
    assert guarded.pwm == 0.0 and guarded.reason is Reason.RAIL_NOT_HELD
    moved = guard_command(
        0.1, Seen(RigState(0.3, math.pi, 0.0, 0.0), 0.0, 0.0), in_vain_s, PERIOD_S, guard
    )
    assert moved.pwm == 0.1 and moved.in_vain_s == 0.0


def test_a_cart_that_comes_away_slowly_is_not_given_up(nominal: Rig) -> None:
    guard, in_vain_s = make_rail_guard(nominal, LIMIT, MARGIN_M), 0.0
    leaving = Seen(RigState(1.5, math.pi, -0.1, 0.0), 0.0, 0.0)
    for _ in range(round(2 * guard.patience_s / PERIOD_S)):
        guarded = guard_command(0.1, leaving, in_vain_s, PERIOD_S, guard)
        in_vain_s = guarded.in_vain_s
    assert guarded.reason is Reason.RAIL_BRAKING and guarded.pwm < 0.0


@given(st.floats(-0.8, 0.8), st.floats(-4.0, 4.0), st.floats(-2.0, 2.0), st.floats(-15.0, 15.0))
def test_a_mirrored_rig_is_as_far_out_at_its_mirrored_end(
    cart_m: float, pole_rad: float, cart_m_s: float, pole_rad_s: float
) -> None:
    guard = make_rail_guard(load_twin(CONFIG / "inteco.yaml").rig, LIMIT, MARGIN_M)
    for sides in (guard, replace(guard, pole_way=-1), replace(guard, pole_way=0)):
        here = find_outermost(RigState(cart_m, pole_rad, cart_m_s, pole_rad_s), 1.0, sides)
        there = find_outermost(RigState(-cart_m, -pole_rad, -cart_m_s, -pole_rad_s), -1.0, sides)
        assert here == pytest.approx(there, abs=1e-12)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("applied", [0.3, -0.3])
def test_the_largest_command_stops_just_before_the_end(
    nominal: Rig, side: int, applied: float
) -> None:
    """The last command for the delay, the new command until the next decision, then the brake.

    The pole hangs, and may swing out beside the cart by its reach and the spread of that.
    """
    guard = make_rail_guard(nominal, LIMIT, MARGIN_M)
    shown = RigState(side * 0.6, math.pi, side * 1.1, 0.0)
    guarded = guard_command(side * LIMIT, Seen(shown, 0.0, side * applied), 0.0, PERIOD_S, guard)
    at_m, speed = 0.6, 1.1
    for command, seconds in ((applied, guard.delay_s), (side * guarded.pwm, guard.hold_s)):
        gain_m_s2 = command * (guard.push_m_s2 if command > 0 else guard.brake_m_s2)
        at_m += speed * seconds + gain_m_s2 * seconds**2 / 2
        speed += gain_m_s2 * seconds
    assert -LIMIT < side * guarded.pwm < LIMIT
    stops_at_m = at_m + compute_braking_distance(speed, guard)
    end_m = guard.end_m - (1 + guard.spread) * guard.reach_m
    assert stops_at_m == pytest.approx(end_m, abs=1e-3) and stops_at_m <= end_m + 1e-9


@given(st.floats(-4.0, 4.0), st.floats(-15.0, 15.0), st.sampled_from([-1.0, 1.0]))
def test_no_pole_within_the_spread_hangs_further_out(
    pole_rad: float, pole_rad_s: float, towards: float
) -> None:
    known = make_rail_guard(load_twin(CONFIG / "inteco.yaml").rig, LIMIT, MARGIN_M)
    for guard in (known, replace(known, pole_way=-1), replace(known, pole_way=0)):
        state = RigState(0.1, pole_rad, 0.2, pole_rad_s)
        furthest_m, fastest_m_s = find_outermost(state, towards, guard)
        places, speeds = [], []
        for share in (1 - guard.spread, 1 + guard.spread):
            for way in (guard.pole_way,) if guard.pole_way else (-1, 1):
                reach_m = way * share * guard.reach_m
                places.append(towards * (0.1 - reach_m * math.sin(pole_rad)))
                speeds.append(towards * (0.2 - reach_m * math.cos(pole_rad) * pole_rad_s))
        assert furthest_m == pytest.approx(max(places), abs=1e-12)
        assert fastest_m_s == pytest.approx(max(speeds), abs=1e-12)


def test_a_rig_without_rail_or_room_is_refused(nominal: Rig) -> None:
    with pytest.raises(BadInputError, match="rail_half_length_m"):
        make_rail_guard(replace(nominal, rail_half_length_m=None), LIMIT)
    sentence = (
        "rail guard: expected rail_half_length_m above 0.57 m (0.05 m, and 1.3 times "
        "com_distance_m, which is 0.4 m), found 0.5 m: measure both, and correct the twin file"
    )
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make_rail_guard(Rig(0.5, 0.1, 0.4, 0.3, 9.81, 12.0, 0.5, 2e-4, 0.5), LIMIT)
    with pytest.raises(BadInputError, match="ways of 1 or -1"):
        make_rail_guard(nominal, LIMIT, way=0)

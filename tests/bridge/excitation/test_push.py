"""A first push that a busy machine sends unevenly is sent again, and never misread."""

import math

import pytest

from pendulum_bridge.excitation.guard import Bounds, StopReason
from pendulum_bridge.excitation.push import MOST_PUSHES, Push, is_even, send_push
from pendulum_bridge.excitation.run import (
    Run,
    Stage,
    begin_looking,
    begin_passing,
    make_health,
    take_sample,
)
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.plans import plan_phases
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.waveforms import Envelope

PERIOD_S = 0.01
BOUNDS = Bounds(far_m=9.0, silence_s=9.0, overruled_s=9.0)
PLAN = make_excitation(
    Plan((plan_phases.Push(), plan_phases.Rest(seconds=1, centred=True))), Envelope()
)
RISES = 30  # sample at which the push begins


def hear(k: int, late: range, lost: bool) -> float | None:
    """Return when sample k is heard by a machine that stands still over the late samples, s."""
    if k in late:
        return None if lost else late.stop * PERIOD_S
    return k * PERIOD_S


def play(late: range, lost: bool, way: int = 1, every_time: bool = False) -> tuple[Run, int]:
    """Play to a cart without friction; return the run once it has judged, and its looks."""
    run, looks, position, speed, before_s, command = begin_looking(0.0, Run()), 1, 0.0, 0.0, 0.0, 0
    played = 0
    for k in range(10_000):
        was = run.stage
        heard_s = hear(played, late, lost) if was is Stage.PLAYING else played * PERIOD_S
        offset_s = (k - played) * PERIOD_S
        played = played + 1 if was is Stage.PLAYING else 0
        if heard_s is None:
            continue
        now_s = offset_s + heard_s
        step_s = max(now_s - before_s, 0.0)
        before_s = max(before_s, now_s)
        position += speed * step_s
        speed = (speed + 10 * way * command * step_s) * (was is Stage.PLAYING)
        state = RigState(position, math.pi, speed, 0.0)
        step = take_sample(round(k * PERIOD_S * 1e9), state, 0.0, now_s, run, PLAN, BOUNDS)
        run, command = step.run, step.command or 0.0
        if run.stage is Stage.RESETTING:
            run = begin_passing(now_s, run)
        if run.stage is Stage.LOOKING and was is Stage.PLAYING:
            looks += 1
            late = late if every_time else range(0)
        if run.performance.playback.way is not None or run.stage is Stage.STOPPED:
            return run, looks
    raise AssertionError("the push was never judged")


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("lost", [True, False])
@pytest.mark.parametrize("first", range(RISES - 20, RISES + 30, 2))
@pytest.mark.parametrize("count", [2, 5, 10, 20])
def test_the_direction_is_right_whatever_stands_still(
    first: int, count: int, lost: bool, way: int
) -> None:
    run, _ = play(range(first, first + count), lost, way)
    assert run.performance.playback.way == way


def test_a_push_whose_rise_is_lost_is_sent_again() -> None:
    run, looks = play(range(RISES - 1, RISES + 14), lost=True)
    assert looks == 2 and run.stage is Stage.PLAYING and run.pushes == 1
    assert make_health(run, PLAN, "").figures["uneven_pushes"] == 1


def test_a_machine_that_never_sends_evenly_gives_up_in_a_sentence() -> None:
    run, looks = play(range(RISES - 1, RISES + 14), lost=True, every_time=True)
    assert looks == MOST_PUSHES and run.stopped.reason is StopReason.PUSH_UNEVEN
    assert f"({MOST_PUSHES} times: this computer is too busy to drive a rig)" in (
        run.stopped.sentence
    )


def judge_uneven_push(last: RigState) -> tuple[Run, float | None]:
    """Send a push whose rise is lost; return the run and the answer once the push is judged.

    last: the state in the last two samples: one beyond a bound may be a spike of the encoder.
    """
    run, answer = Run(stage=Stage.PLAYING), None
    for k in [*range(RISES - 1), *range(RISES + 14, PLAN.push_ends + 1)]:
        state = last if k >= PLAN.push_ends - 1 else RigState(0.0, math.pi, 0.0, 0.0)
        step = take_sample(round(k * 1e7), state, 0.0, k * PERIOD_S, run, PLAN, BOUNDS)
        run, answer = step.run, step.command
        assert run.stage is Stage.PLAYING or k == PLAN.push_ends
    return run, answer


@pytest.mark.parametrize(
    ("last", "reason"),
    [
        (RigState(9.5, math.pi, 0.0, 0.0), StopReason.CART_TOO_FAR),
        (RigState(0.02, math.pi, 5.5, 0.0), StopReason.CART_TOO_FAST),
        (RigState(0.02, math.pi, 0.0, -41.0), StopReason.POLE_TOO_FAST),
    ],
)
def test_the_guards_stop_wins_over_an_uneven_push(last: RigState, reason: StopReason) -> None:
    run, answer = judge_uneven_push(last)
    assert run.stage is Stage.STOPPED and run.stopped.reason is reason
    assert answer == 0.0 and run.pushes == 0  # nothing is sent again


@pytest.mark.parametrize("moved_m", [0.0, 0.02])
def test_a_cart_that_an_uneven_push_did_not_move_is_pushed_again(moved_m: float) -> None:
    run, answer = judge_uneven_push(RigState(moved_m, math.pi, 0.0, 0.0))
    assert run.stage is Stage.LOOKING and run.stopped is None
    assert answer == 0.0 and run.pushes == 1


def test_a_rig_in_process_runs_faster_than_time() -> None:
    push = Push()
    for k, command in enumerate(PLAN.commands[: PLAN.push_ends + 1]):
        push = send_push(command, 1e-6 * k, k * PERIOD_S, push)
    assert push.seconds == pytest.approx(PLAN.push_ends * PERIOD_S) and is_even(push, PLAN)

"""An excitation is stopped for each reason, at the sample that shows the reason, not before."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.excitation.guard import (
    RECENT_S,
    Bounds,
    Stopped,
    StopReason,
    Watch,
    find_exceeded_bound,
    find_missing_samples,
    is_obeyed,
    note_request,
    watch_sample,
)
from pendulum_bridge.excitation.performance import Performance, perform
from pendulum_bridge.excitation.playback import (
    MOST_LOOKS,
    SAMPLES_A_LOOK,
    SAMPLES_QUEUED,
    STEADY_LOOKS,
)
from pendulum_bridge.excitation.run import (
    Run,
    Stage,
    begin_looking,
    begin_passing,
    compute_share,
    describe_progress,
    enter_stage,
    find_silence,
    make_health,
    stop_run,
    take_sample,
)
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Level
from pendulum_twin.plans.excitation import Excitation, make_standard_plan
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Push, Rest, Samples, Steps
from pendulum_twin.plans.waveforms import Envelope
from pendulum_twin.rig import Rig

PERIOD_S, PERIOD_NS = 0.01, 10_000_000
BOUNDS = Bounds(far_m=0.85)
STILL = RigState(0.0, math.pi, 0.0, 0.0)
PLAN = make_excitation(
    Plan((Push(), Steps(seconds=2, amplitude=0.3), Rest(seconds=1, centred=True))), Envelope()
)
UNPUSHED = make_excitation(Plan((Samples(commands=(0.1,) * 99, centred=False),)), Envelope())


@pytest.mark.parametrize("reason", StopReason)
def test_every_reason_is_a_sentence(reason: StopReason) -> None:
    said = Stopped(reason, "found this").sentence
    assert said[0].isupper() and "found this" in said and said.endswith(".")


OUTSIDE = [
    (RigState(0.86, math.pi, 0, 0), StopReason.CART_TOO_FAR),
    (RigState(-0.86, math.pi, 0, 0), StopReason.CART_TOO_FAR),
    (RigState(0, math.pi, 5.1, 0), StopReason.CART_TOO_FAST),
    (RigState(0, math.pi, -5.1, 0), StopReason.CART_TOO_FAST),
    (RigState(0, math.pi, 0, 41), StopReason.POLE_TOO_FAST),
    (RigState(0, math.pi, 0, -41), StopReason.POLE_TOO_FAST),
]


@pytest.mark.parametrize(("state", "reason"), OUTSIDE)
def test_a_bound_stops_at_the_second_sample_beyond_it(state: RigState, reason: StopReason) -> None:
    watch, first = watch_sample(state, 0.0, PERIOD_S, Watch(), BOUNDS)
    _, again = watch_sample(state, 0.0, PERIOD_S, watch, BOUNDS)
    assert (
        first is None
        and again is not None
        and again.reason is reason
        and "at most" in again.detail
    )


@pytest.mark.parametrize(("state", "_reason"), OUTSIDE)
def test_a_single_spike_does_not(state: RigState, _reason: StopReason) -> None:
    watch, stops = Watch(), []
    for k in range(20):
        watch, stopped = watch_sample(state if k % 2 else STILL, 0.0, PERIOD_S, watch, BOUNDS)
        stops.append(stopped)
    assert stops == [None] * 20


@given(
    st.builds(
        RigState,
        st.floats(-0.85, 0.85),
        st.floats(-1e3, 1e3),
        st.floats(-5, 5),
        st.floats(-40, 40),
    ),
)
def test_within_the_bounds_nothing_is_beyond(state: RigState) -> None:
    assert find_exceeded_bound(state, BOUNDS) is None


def count_until_overruled(applied: list[float], requests: list[float]) -> int | None:
    """Return at which sample the watch stops, for these applied and requested commands."""
    watch = Watch()
    for k, (sent, wanted) in enumerate(zip(applied, requests, strict=True)):
        watch, stopped = watch_sample(STILL, sent, PERIOD_S, watch, BOUNDS)
        if stopped:
            assert stopped.reason is StopReason.OVERRULED
            return k
        watch = note_request(wanted, PERIOD_S, watch)
    return None


def test_a_driver_that_sends_something_else_for_long_stops_the_plan() -> None:
    assert count_until_overruled([0.1] * 200, [0.3] * 200) == pytest.approx(
        0.5 / PERIOD_S + 11, abs=2
    )


def test_one_that_overrules_two_thirds_of_the_time_does_so_later() -> None:
    requests, applied = [0.3] * 400, ([0.1] * 2 + [0.3]) * 133 + [0.1]
    assert count_until_overruled(applied, requests) == pytest.approx(
        3 * 0.5 / PERIOD_S + 10, abs=20
    )
    assert count_until_overruled(([0.1] + [0.3] * 2) * 133 + [0.3], requests) is None


@pytest.mark.parametrize("behind", [1, 2, 8])
def test_one_that_is_a_little_behind_or_slewing_does_not(behind: int) -> None:
    requests = make_standard_plan(seconds=40).commands.tolist()
    late = [0.0] * behind + requests[:-behind]
    assert count_until_overruled(late, requests) is None
    slewing = [0.0]
    for wanted in late:
        slewing.append(slewing[-1] + min(max(wanted - slewing[-1], -0.1), 0.1))
    assert count_until_overruled(slewing[1:], requests) is None


def test_recent_commands_are_those_of_the_last_tenth_of_a_second() -> None:
    watch = Watch()
    for k in range(40):
        watch = note_request(0.01 * k, PERIOD_S, watch)
    first = 39 - round(RECENT_S / PERIOD_S)
    assert watch.requests == tuple(0.01 * k for k in range(first, 40))


def test_obeyed_is_between_recent_commands() -> None:
    assert (
        is_obeyed(0.1, (0.0, 0.3))
        and is_obeyed(0.31, (0.0, 0.3))
        and not is_obeyed(0.33, (0.0, 0.3))
    )


def test_silence_is_missing_samples() -> None:
    assert find_missing_samples(0.2, BOUNDS) is None
    assert "no new one for 0.25 s, at most 0.2 s" in find_missing_samples(0.25, BOUNDS).sentence


@pytest.mark.parametrize("bad", [math.nan, 0.0, -1.0])
def test_bounds_that_are_none_are_refused(bad: float) -> None:
    with pytest.raises(BadInputError, match="pole_rad_s: expected a number above 0, found"):
        Bounds(0.8, pole_rad_s=bad)


def driven(
    rig: EmulatedRig, plan: Excitation, bounds: Bounds, skip: range = range(0)
) -> tuple[Performance, Stopped | None]:
    """Play a plan on a rig in process; samples in `skip` are lost."""
    performance, applied = Performance(), 0.0
    for k in range(len(plan.commands) + 1):
        state = RigState(*rig.sample.tolist())
        if k not in skip:
            move = perform(k * PERIOD_NS, state, applied, performance, plan, bounds)
            performance, applied = move.performance, move.command
            if move.stopped or move.done:
                assert move.command == 0.0
                return performance, move.stopped
        rig.step(applied)
    raise AssertionError("it never ended")


def test_a_rig_within_its_bounds_is_played_to_the_end(nominal: Rig) -> None:
    performance, stopped = driven(
        EmulatedRig(Concealed({}, nominal), timestep_s=1e-3), PLAN, BOUNDS
    )
    assert stopped is None and performance.playback.way == 1


def test_a_cart_that_does_not_move_ends_the_plan_after_the_push(nominal: Rig) -> None:
    stuck = Concealed({"cart_coulomb_friction": {"level_n": 8.0}}, nominal)
    performance, stopped = driven(EmulatedRig(stuck, timestep_s=1e-3), PLAN, BOUNDS)
    assert stopped.reason is StopReason.NOT_MOVED and performance.playback.sample == PLAN.push_ends


def test_a_cart_that_leaves_is_stopped_before_the_end_of_the_rail(nominal: Rig) -> None:
    away = make_excitation(Plan((Samples(commands=(0.2,) * 300, centred=False),)), Envelope())
    rig = EmulatedRig(Concealed({}, nominal), timestep_s=1e-3)
    _, stopped = driven(rig, away, BOUNDS)
    assert stopped.reason is StopReason.CART_TOO_FAR
    assert 0.85 < rig.sample[0] < 0.9


@pytest.mark.parametrize(("lost", "ends"), [(range(100, 119), False), (range(100, 121), True)])
def test_a_gap_in_the_stamps_of_more_than_the_silence_stops(
    lost: range, ends: bool, nominal: Rig
) -> None:
    performance, stopped = driven(
        EmulatedRig(Concealed({}, nominal), timestep_s=1e-3), PLAN, BOUNDS, lost
    )
    assert (stopped.reason if stopped else None) == (StopReason.SAMPLES_MISSING if ends else None)
    assert performance.playback.lost == len(lost)


def reset(run: Run, first_ns: int) -> Run:
    """Return a run that has looked, once its rig is reset and older samples are passed over."""
    assert run.stage is Stage.RESETTING
    run = begin_passing(1e-9 * first_ns, run)
    for stamp_ns in stamps(SAMPLES_QUEUED + 1, first_ns=first_ns):
        assert run.stage is Stage.PASSING
        step = take_sample(stamp_ns, STILL, 0.0, 1e-9 * stamp_ns, run, PLAN, BOUNDS)
        run = step.run
        assert step.command == 0.0
    assert run.stage is Stage.PLAYING
    return run


def looked(run: Run, stamps_ns: list[int]) -> tuple[Run, list[float | None]]:
    """Show a run samples with these stamps for as long as it looks; return it and what it sent."""
    sent = []
    for stamp_ns in stamps_ns:
        if run.stage is Stage.LOOKING:
            step = take_sample(stamp_ns, STILL, 0.0, 1e-9 * stamp_ns, run, PLAN, BOUNDS)
            run = step.run
            sent.append(step.command)
    return run, sent


def stamps(count: int, periods: float = 1, first_ns: int = 0) -> list[int]:
    return [first_ns + round(k * periods * PERIOD_NS) for k in range(count)]


def test_a_run_looks_and_resets_before_it_plays_and_sends_0_meanwhile() -> None:
    """However long the look takes, the plan begins with the cart in the middle."""
    run, sent = looked(begin_looking(0.0, enter_stage(Stage.WAITING, 0.0, Run())), stamps(99))
    assert sent == [0.0] * SAMPLES_A_LOOK
    run = reset(run, 100 * PERIOD_NS)
    step = take_sample(130 * PERIOD_NS, STILL, 0.0, 1.0, run, PLAN, BOUNDS)
    assert step.run.performance.playback.sample == 0 and step.command == PLAN.commands[0]


def test_a_run_at_another_rate_is_refused_in_a_sentence() -> None:
    run, sent = looked(begin_looking(0.0, Run()), stamps(999, periods=2))
    assert run.stage is Stage.STOPPED and sent == [0.0] * STEADY_LOOKS * SAMPLES_A_LOOK
    assert "expected 100 Hz, found 50 Hz: give the plan the rig's rate_hz" in run.stopped.sentence


def test_a_rate_that_fits_only_later_is_good() -> None:
    late = stamps(30, periods=2.5) + stamps(70, first_ns=80 * PERIOD_NS)
    run, sent = looked(begin_looking(0.0, Run()), late)
    assert run.stage is Stage.RESETTING and len(sent) == 2 * SAMPLES_A_LOOK


def restless(looks: int) -> list[int]:
    """Return stamps of a busy computer, whose samples come at another wrong rate each time."""
    gaps = [(0.8 + 0.1 * (look % 2)) * PERIOD_NS for look in range(looks)]
    return [round(t) for t in np.cumsum(np.repeat(gaps, SAMPLES_A_LOOK))]


def test_a_rate_that_does_not_settle_gets_time() -> None:
    busy = restless(MOST_LOOKS // 2)
    run, sent = looked(begin_looking(0.0, Run()), busy + stamps(99, first_ns=busy[-1]))
    assert run.stage is Stage.RESETTING and len(sent) == len(busy) + SAMPLES_A_LOOK
    run, sent = looked(begin_looking(0.0, Run()), restless(2 * MOST_LOOKS))
    assert run.stage is Stage.STOPPED and len(sent) == MOST_LOOKS * SAMPLES_A_LOOK
    assert run.stopped.sentence.endswith("this computer is too busy).")


def test_before_it_begins_nothing_is_answered() -> None:
    for stage in (Stage.WAITING, Stage.RESETTING):
        step = take_sample(0, STILL, 0.0, 3.0, enter_stage(stage, 0.0, Run()), PLAN, BOUNDS)
        assert step.command is None and step.run.sampled_s == 3.0
        assert find_silence(9.0, step.run, BOUNDS) is None  # the reset has a deadline of its own


def test_silence_counts_from_the_start_of_the_look() -> None:
    run = begin_looking(5.0, Run())
    assert find_silence(5.1, run, BOUNDS) is None
    assert find_silence(5.3, run, BOUNDS).reason is StopReason.SAMPLES_MISSING


def playing(count: int) -> Run:
    """Return a run that has answered so many samples of a plan without a push."""
    run = enter_stage(Stage.PLAYING, 0.0, Run())
    for stamp_ns in stamps(count, first_ns=10**13):
        run = take_sample(stamp_ns, STILL, 0.0, 1.0, run, UNPUSHED, BOUNDS).run
    return run


@pytest.mark.parametrize("back_s", [3600.0, 2.0, 0.25])
def test_a_clock_that_is_set_back_stops_the_plan(back_s: float) -> None:
    """Every sample would be older than one that was answered: no command, and no silence."""
    stamp_ns = stamps(9, first_ns=10**13)[-1] - round(1e9 * back_s)
    step = take_sample(stamp_ns, STILL, 0.0, 1.01, playing(9), UNPUSHED, BOUNDS)
    assert step.command == 0.0 and step.run.stage is Stage.STOPPED
    assert step.run.stopped.reason is StopReason.CLOCK_SET_BACK
    assert f"found one {back_s:.3g} s before the last" in step.run.stopped.sentence


@pytest.mark.parametrize("back_s", [0.0, 0.1])
def test_samples_that_are_not_newer_are_as_good_as_none(back_s: float) -> None:
    stamp_ns, run = stamps(9, first_ns=10**13)[-1] - round(1e9 * back_s), playing(9)
    for now_s in (1.1, 1.19, 1.21):
        step = take_sample(stamp_ns, STILL, 0.0, now_s, run, UNPUSHED, BOUNDS)
        run = step.run
        assert step.command is None and run.stage is Stage.PLAYING
        silence = find_silence(now_s, run, BOUNDS)
        assert (silence.reason if silence else None) == (
            StopReason.SAMPLES_MISSING if now_s > 1.2 else None
        )


def test_a_run_says_where_it_is() -> None:
    run = reset(looked(begin_looking(0.0, Run()), stamps(99))[0], 100 * PERIOD_NS)
    for k in range(226):
        state = RigState(0.0005 * k, math.pi, 0.0, 0.0)
        run = take_sample(
            (130 + k) * PERIOD_NS,
            state,
            0.0,
            1.0,
            run,
            PLAN,
            Bounds(1.0, overruled_s=9.0),
        ).run
    assert describe_progress(run, PLAN) == "plays steps: 2.2 s of 4.5 s, 2.2 s to go"
    assert compute_share(run, PLAN) == 0.5
    assert make_health(run, PLAN, "").level is Level.OK
    assert (
        make_health(enter_stage(Stage.WAITING, 0.0, Run()), PLAN, "no rig").sentence
        == "The node waits for rig and twin: no rig."
    )
    stopped = stop_run(Stopped(StopReason.ABORTED), 2.0, run)
    assert make_health(stopped, PLAN, "").level is Level.ERROR and not stopped.stage.active
    assert make_health(stopped, PLAN, "").sentence == "The plan was aborted by request."

"""A run of a plan from its beginning to its end: its stages, its commands, and its health."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

from pendulum_bridge.excitation.guard import (
    Bounds,
    Stopped,
    StopReason,
    find_missing_samples,
    is_near_middle,
    make_cart_away,
)
from pendulum_bridge.excitation.performance import Performance, perform
from pendulum_bridge.excitation.playback import (
    MOST_LOOKS,
    SAMPLES_A_LOOK,
    SAMPLES_QUEUED,
    is_rate_fitting,
    is_rate_steady,
    measure_rate,
)
from pendulum_bridge.excitation.push import MOST_PUSHES, Push, is_even, send_push
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.health import Health, Level
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.topics import PLAYED, UNDER_WAY

# resets before a plan: on a busy computer a cart on a tilted rail rolls off after some of them
MOST_RESETS = 5


class Stage(Enum):
    """Name where a run is; each value continues 'the node'."""

    IDLE = "waits to be started"
    WAITING = "waits for rig and twin"
    LOOKING = "looks at the rate of the rig's samples"
    RESETTING = "resets rig and twin"
    PASSING = "passes over the samples from before the reset"
    PLAYING = "plays"
    DONE = "has played the plan"
    STOPPED = "was stopped"

    @property
    def active(self) -> bool:
        """Whether a run is under way."""
        return self not in (Stage.IDLE, Stage.DONE, Stage.STOPPED)

    @property
    def commanding(self) -> bool:
        """Whether samples are answered."""
        return self in (Stage.LOOKING, Stage.PASSING, Stage.PLAYING)


@dataclass(frozen=True)
class Run:
    """Hold the state of a run.

    stage: where it is.
    since_s: s, monotonic; when the stage began.
    sampled_s: s, monotonic; when the last sample came, while it plays the last new one; None
        before the first.
    stamps_ns: ns; stamps of the samples that show the rate, since it was measured last.
    looks_hz: Hz; the rate as it was measured before, each time a wrong one.
    resets: resets that have been done before the plan.
    passed: samples passed over since the last of them.
    performance: the state of the plan being played.
    push: the plan's first push as it was sent.
    pushes: uneven pushes before it.
    stopped: why the run ended before its end; None when it did not.
    """

    stage: Stage = Stage.IDLE
    since_s: float = 0.0
    sampled_s: float | None = None
    stamps_ns: tuple[int, ...] = ()
    looks_hz: tuple[float, ...] = ()
    resets: int = 0
    passed: int = 0
    performance: Performance = Performance()  # noqa: RUF009 (frozen)
    push: Push = Push()  # noqa: RUF009 (frozen)
    pushes: int = 0
    stopped: Stopped | None = None


@dataclass(frozen=True)
class Step:
    """Hold the run after a sample, and the answer to the sample.

    run: the state for the next sample.
    command: PWM fraction; None for no answer.
    """

    run: Run
    command: float | None = None


def enter_stage(stage: Stage, now_s: float, run: Run) -> Run:
    """Return the run in another stage."""
    return replace(run, stage=stage, since_s=now_s)


def begin_looking(now_s: float, run: Run) -> Run:
    """Return the run with rig and twin ready: it measures the rate of samples.

    A busy computer may need long for that, and a cart on a tilted rail rolls off meanwhile. So the
    rate is measured before the reset, and the plan begins with the cart in the middle.
    """
    return replace(enter_stage(Stage.LOOKING, now_s, run), sampled_s=now_s)


def begin_passing(now_s: float, run: Run) -> Run:
    """Return the run with rig and twin reset: older samples may still wait in the queues."""
    resets = run.resets + 1
    return replace(
        enter_stage(Stage.PASSING, now_s, run), sampled_s=now_s, resets=resets, passed=0
    )


def stop_run(stopped: Stopped, now_s: float, run: Run) -> Run:
    """Return the run stopped before its end; the caller has to send 0 if it was commanding."""
    return replace(enter_stage(Stage.STOPPED, now_s, run), stopped=stopped)


def take_sample(
    stamp_ns: int,
    state: RigState,
    applied: float,
    now_s: float,
    run: Run,
    plan: Excitation,
    bounds: Bounds,
) -> Step:
    """Return the run after a sample.

    stamp_ns: ns; the sampling time.
    applied: PWM fraction; what the driver last reported as sent.
    now_s: s, monotonic; when the sample came.
    """
    if run.stage is Stage.PLAYING:
        return _play_sample(stamp_ns, state, applied, now_s, run, plan, bounds)
    run = replace(run, sampled_s=now_s)
    if run.stage is Stage.LOOKING:
        return Step(_look_at_rate(stamp_ns, now_s, run, plan), 0.0)
    if run.stage is Stage.PASSING:
        return Step(_pass_over_sample(state, now_s, run, bounds), 0.0)
    return Step(run)


def _play_sample(
    stamp_ns: int,
    state: RigState,
    applied: float,
    now_s: float,
    run: Run,
    plan: Excitation,
    bounds: Bounds,
) -> Step:
    """Return the run after a sample of the plan; one that is not new is as good as none."""
    move = perform(stamp_ns, state, applied, run.performance, plan, bounds)
    if move.command is not None:
        run = replace(run, sampled_s=now_s)
    if move.command is not None and run.performance.playback.way is None:
        run = replace(run, push=send_push(move.command, now_s, stamp_ns / 1e9, run.push))
        judged = move.performance.playback.way is not None
        unmoved = move.stopped is not None and move.stopped.reason is StopReason.NOT_MOVED
        if judged and (unmoved or not move.stopped) and not is_even(run.push, plan):
            return Step(_push_again(now_s, run), 0.0)
    run = replace(run, performance=move.performance)
    if move.stopped:
        run = stop_run(move.stopped, now_s, run)
    elif move.done:
        run = enter_stage(Stage.DONE, now_s, run)
    return Step(run, move.command)


def _push_again(now_s: float, run: Run) -> Run:
    """Return the run after an uneven push: it looks at the rate, resets, and begins the plan."""
    pushes = run.pushes + 1
    if pushes == MOST_PUSHES:
        detail = f"{pushes} times: this computer is too busy to drive a rig"
        return stop_run(Stopped(StopReason.PUSH_UNEVEN, detail), now_s, run)
    return begin_looking(now_s, Run(pushes=pushes))


def _look_at_rate(stamp_ns: int, now_s: float, run: Run, plan: Excitation) -> Run:
    """Return the run after a sample before the plan, which shows the rate.

    A busy machine may lose most samples for a while: a rate that does not fit is measured again,
    until the measurements agree on it.
    """
    stamps_ns = (*run.stamps_ns, stamp_ns)
    if len(stamps_ns) < SAMPLES_A_LOOK:
        return replace(run, stamps_ns=stamps_ns)
    seen_hz = measure_rate(stamps_ns, plan.rate_hz)
    run = replace(run, stamps_ns=(), looks_hz=(*run.looks_hz, seen_hz))
    if is_rate_fitting(seen_hz, plan.rate_hz):
        return enter_stage(Stage.RESETTING, now_s, run)
    steady = is_rate_steady(run.looks_hz)
    if not steady and len(run.looks_hz) < MOST_LOOKS:
        return run
    advice = "give the plan the rig's rate_hz" if steady else "this computer is too busy"
    detail = f"expected {plan.rate_hz:g} Hz, found {seen_hz:.3g} Hz: {advice}"
    return stop_run(Stopped(StopReason.RATE_WRONG, detail), now_s, run)


def _pass_over_sample(state: RigState, now_s: float, run: Run, bounds: Bounds) -> Run:
    """Return the run after a sample that may be older than the reset.

    After the last of them the plan begins, if the cart is still near the middle: its first push
    needs room. A cart that has rolled off is reset again.
    """
    if run.passed < SAMPLES_QUEUED:
        return replace(run, passed=run.passed + 1)
    if is_near_middle(state, bounds):
        return enter_stage(Stage.PLAYING, now_s, run)
    if run.resets < MOST_RESETS:
        return enter_stage(Stage.RESETTING, now_s, run)
    advice = (
        f", after {run.resets} resets: level the rail, or see why the cart does not stay where a "
        "reset leaves it"
    )
    return stop_run(make_cart_away(state, bounds, advice), now_s, run)


def find_silence(now_s: float, run: Run, bounds: Bounds) -> Stopped | None:
    """Return that the rig has fallen silent; None while it sends, or need not send."""
    if not run.stage.commanding or run.sampled_s is None:
        return None
    return find_missing_samples(now_s - run.sampled_s, bounds)


def compute_share(run: Run, plan: Excitation) -> float:
    """Return the share of the plan that has been played, 0 to 1."""
    return min(max(run.performance.playback.sample, 0) / len(plan.commands), 1.0)


def describe_progress(run: Run, plan: Excitation) -> str:
    """Return where the run is, in words that follow 'the node'."""
    if run.stage is Stage.DONE:
        return (
            f"{run.stage.value}: {plan.seconds:g} s, {run.performance.playback.lost} samples lost"
        )
    if run.stage is not Stage.PLAYING:
        return run.stage.value
    sample, whole_s = max(run.performance.playback.sample, 0), plan.seconds
    played_s = sample / plan.rate_hz
    return (
        f"plays {plan.get_stretch(sample)}: {played_s:.1f} s of {whole_s:.1f} s, "
        f"{whole_s - played_s:.1f} s to go"
    )


def describe_outcome(run: Run) -> str:
    """Return how the plan stands, for who records it: played, under way, or why it was stopped."""
    if run.stopped:
        return f"not played to its end: {run.stopped.sentence}"
    return PLAYED if run.stage is Stage.DONE else UNDER_WAY


def make_health(run: Run, plan: Excitation, lacking: str) -> Health:
    """Return the run's health.

    lacking: what the run waits for; empty when it does not wait.
    """
    playback = run.performance.playback
    figures: dict[str, float | int | str] = {
        "share_played": compute_share(run, plan),
        "samples_lost": playback.lost,
        "samples_old": playback.old,
        "uneven_pushes": run.pushes,
        "resets": run.resets,
        "overruled_s": run.performance.watch.overruled_s,
    }
    if run.stopped:
        return Health(Level.ERROR, run.stopped.sentence, figures)
    return Health(
        Level.OK,
        f"The node {describe_progress(run, plan)}{f': {lacking}' if lacking else ''}.",
        figures,
    )

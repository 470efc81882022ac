"""Play a plan to rig and twin at once: each sample of the rig is answered with the same command.

The node waits until all is ready, measures the rate of the samples, resets both, again where the
cart does not stay near the middle, plays, and sends 0: at the end, on any fault
(`excitation.guard`), and when it is terminated. Its services: `start` (for start:=service) and
`abort`; its topic `progress`: the share of the plan that has been played, 0 to 1; its topic
`outcome`: how the plan stands, in words that a recorder keeps.
"""

from __future__ import annotations

import math
import sys
from time import monotonic
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64
from std_srvs.srv import Trigger

from pendulum_bridge.excitation.guard import Stopped, StopReason, is_near_middle, make_cart_away
from pendulum_bridge.excitation.run import (
    Run,
    Stage,
    begin_looking,
    begin_passing,
    describe_progress,
    enter_stage,
    find_silence,
    make_health,
    stop_run,
    take_sample,
)
from pendulum_bridge.nodes.excitation_reports import Reports
from pendulum_bridge.nodes.excitation_settings import (
    AUTO,
    ExcitationSettings,
    choose_plan,
    make_bounds,
)
from pendulum_bridge.nodes.pendulum_client import PendulumClient
from pendulum_bridge.nodes.reset_sequence import ResetSequence
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Level
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.guard import guard_method
from pendulum_twin.nodes.messages import from_joint_state, from_time
from pendulum_twin.nodes.qos import LATCHED, SAMPLES
from pendulum_twin.nodes.running import run, spin
from pendulum_twin.nodes.settings import declare_settings
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.standstill import NAMED_S, describe_standstill
from pendulum_twin.stop_request import StopRequest

TICK_S = 0.05
STANDSTILL_COUNTS_S = 5.0  # an older standstill explains nothing
STALE_REPORT_S = 1.0  # a report so soon after the start may be about the time before


class ExcitationNode(Node):
    """Play a plan; raise BadInputError when a parameter, the plan or the twin file is wrong."""

    def __init__(self, **options: Any) -> None:
        super().__init__("excitation", **options)
        try:
            self._settings = settings = declare_settings(self, ExcitationSettings)
            room = make_envelope(load_twin(settings.twin_file).rig)
            self._plan = choose_plan(settings, room)
        except BadInputError:
            super().destroy_node()
            raise
        self._bounds = make_bounds(settings, room)
        self._rig = PendulumClient(self, settings.rig)
        self._pendulums = (
            self._rig,
            *([PendulumClient(self, settings.twin)] if settings.twin else []),
        )
        self._run = Run()
        self._applied: float | None = None
        self._emergency = False
        self._resetting = ResetSequence((), 0.0)
        self._ticked_s = monotonic()
        self._stood_still = (-math.inf, 0.0)  # when the last standstill ended, and its length, s
        self._listen()
        if settings.start == AUTO:
            self._begin()

    def _listen(self) -> None:
        self._reports = Reports(self, self._plan, not self._settings.exit_when_done)
        self.create_subscription(
            JointState, self._rig.name_topic(topics.JOINT_STATES), self.on_sample, SAMPLES
        )
        self.create_subscription(
            Float64, self._rig.name_topic(topics.APPLIED_PWM), self.on_applied, SAMPLES
        )
        self.create_subscription(
            Bool, self._rig.name_topic(topics.STOPPED), self.on_emergency, LATCHED
        )
        self.create_subscription(DiagnosticArray, topics.DIAGNOSTICS, self.on_diagnostics, SAMPLES)
        self.create_service(Trigger, topics.START, self.on_start)
        self.create_service(Trigger, topics.ABORT, self.on_abort)
        self.create_timer(TICK_S, self.on_tick, clock=Clock(clock_type=ClockType.STEADY_TIME))
        publish_health(
            self,
            lambda: self._settings.rig,
            lambda: make_health(self._run, self._plan, self._find_lacking()),
        )

    @property
    def over(self) -> bool:
        """Whether the node has nothing more to do."""
        return self._settings.exit_when_done and self._run.stage in (Stage.DONE, Stage.STOPPED)

    def end(self) -> str | None:
        """Stop a plan under way; return why the last plan was not played to its end, or None."""
        if self._run.stage.active:
            self._stop(StopReason.INTERRUPTED, self._where)
        return self._run.stopped.sentence if self._run.stopped else None

    def fail_safe(self) -> None:
        """Stop the plan: a callback failed."""
        if self._run.stage.active:
            self._stop(StopReason.FAILED, "its log says how")

    def destroy_node(self) -> None:
        """Send 0 if a plan is under way, wait until it has arrived, and destroy the node."""
        if self.context.ok():
            if self._run.stage.commanding:
                self._send(0.0)
            for pendulum in self._pendulums:
                pendulum.deliver()
            self._reports.deliver()
        super().destroy_node()

    @guard_method
    def on_sample(self, message: JointState) -> None:
        """Answer a sample of the rig."""
        if not self._run.stage.active:
            return
        try:
            state = _read_state(message)
        except BadInputError as error:
            self._stop(StopReason.SAMPLE_MALFORMED, str(error))
            return
        stamp_ns, applied, before = (
            from_time(message.header.stamp),
            self._applied or 0.0,
            self._run.stage,
        )
        step = take_sample(
            stamp_ns, state, applied, monotonic(), self._run, self._plan, self._bounds
        )
        if step.command is not None:
            self._send(step.command)
        self._run = step.run
        if self._run.stage is not before:
            if self._run.stage is Stage.RESETTING:
                self._begin_reset(state)
            self._reports.announce(self._run)

    @guard_method
    def on_applied(self, message: Float64) -> None:
        """Note what the driver has sent."""
        self._applied = message.data

    @guard_method
    def on_emergency(self, message: Bool) -> None:
        """Stop the plan when the emergency stop is latched."""
        self._emergency = message.data
        if message.data and self._run.stage.active:
            self._stop(StopReason.EMERGENCY_STOP)

    @guard_method
    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Stop the plan when a node of the rig reports an error."""
        if (
            self._run.stage is not Stage.PLAYING
            or monotonic() - self._run.since_s < STALE_REPORT_S
        ):
            return
        for status in message.status:
            if status.name.startswith(self._rig.name_topic("")) and status.level[0] == Level.ERROR:
                self._stop(StopReason.DRIVER_ERROR, status.message)
                return

    @guard_method
    def on_start(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin the plan, unless a plan is under way."""
        response.success = not self._run.stage.active
        response.message = (
            "the plan begins when all is ready"
            if response.success
            else f"the node {self._where} already"
        )
        if response.success:
            self._begin()
        return response

    @guard_method
    def on_abort(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Stop the plan that is under way."""
        response.success = self._run.stage.active
        response.message = (
            f"the plan is aborted{self._resetting.describe_pending()}"
            if response.success
            else f"nothing to abort: the node {self._where}"
        )
        if response.success:
            self._stop(StopReason.ABORTED, self._where)
        return response

    @guard_method
    def on_tick(self) -> None:
        """Do what does not depend on a sample: wait, reset, watch for silence, report progress."""
        now = monotonic()
        gap_s, self._ticked_s = now - self._ticked_s, now
        late = gap_s > 2 * TICK_S
        if gap_s > NAMED_S:
            self._stood_still = (now, gap_s)
        if self._run.stage is Stage.WAITING:
            self._wait(now)
        elif self._run.stage is Stage.RESETTING:
            self._reset(now)
        # a node that is late itself has samples waiting
        elif not late and (silence := find_silence(now, self._run, self._bounds)):
            self._stop(silence.reason, silence.detail + self._tell_standstill(now))
        if self._run.stage is Stage.PLAYING:
            self._reports.report(self._run, now)

    def _tell_standstill(self, now: float) -> str:
        """Return that this computer stood still lately, to follow a detail; else nothing."""
        ended_s, seconds = self._stood_still
        lately = now - ended_s < STANDSTILL_COUNTS_S
        return f"; {describe_standstill(seconds)}: it is busy" if lately else ""

    def _begin(self) -> None:
        self._run = enter_stage(Stage.WAITING, monotonic(), Run())
        self._applied = None
        self._reports.announce(self._run)

    def _wait(self, now: float) -> None:
        if self._emergency:
            self._stop(StopReason.EMERGENCY_STOP)
        elif not (lacking := self._find_lacking()):
            self._run = begin_looking(now, self._run)
            self._reports.announce(self._run)
        elif now - self._run.since_s > self._settings.ready_timeout_s:
            self._stop(
                StopReason.NOT_READY, f"{lacking}, after {self._settings.ready_timeout_s:g} s"
            )
        else:
            self._reports.tell_lacking(lacking, now)

    def _find_lacking(self) -> str:
        """Return what is missing before the plan can begin; empty when all is there."""
        if self._run.stage is not Stage.WAITING:
            return ""
        if self._run.sampled_s is None:
            return (
                f"no samples on {self._rig.name_topic(topics.JOINT_STATES)}: does the driver run, "
                "and is the rig on?"
            )
        if self._applied is None:
            return f"nothing on {self._rig.name_topic(topics.APPLIED_PWM)}: does the driver run?"
        wanted = [self._settings.listeners] + [1] * (len(self._pendulums) - 1)
        lacking = (
            p.find_lacking(n, self._settings.reset_first)
            for p, n in zip(self._pendulums, wanted, strict=True)
        )
        return next(filter(None, lacking), "")

    def _begin_reset(self, state: RigState) -> None:
        """Reset all, the rig last, as it may roll off meanwhile; or begin without a reset.

        After an uneven push the cart moves, wherever it is.
        """
        near = is_near_middle(state, self._bounds)
        ready = near and not self._run.pushes
        if self._settings.reset_first or (self._settings.reset_when_away and not ready):
            self._resetting = ResetSequence(self._pendulums[::-1], self._settings.reset_timeout_s)
        elif near:
            self._run = enter_stage(Stage.PLAYING, monotonic(), self._run)
        else:
            advice = ": move it to the middle, or let it be reset: reset_first:=true"
            stopped = make_cart_away(state, self._bounds, advice)
            self._run = stop_run(stopped, monotonic(), self._run)

    def _reset(self, now: float) -> None:
        if not self._resetting.done(now):
            return
        if self._resetting.failure:
            self._stop(StopReason.RESET_FAILED, self._resetting.failure)
        else:
            self._run = begin_passing(now, self._run)
            self._reports.announce(self._run)

    def _stop(self, reason: StopReason, detail: str = "") -> None:
        if self._run.stage.commanding:
            self._send(0.0)
        self._run = stop_run(Stopped(reason, detail), monotonic(), self._run)
        self._reports.announce(self._run)

    def _send(self, pwm: float) -> None:
        for pendulum in self._pendulums:
            pendulum.send(pwm)

    @property
    def _where(self) -> str:
        return describe_progress(self._run, self._plan) + self._resetting.describe_pending()


def _read_state(message: JointState) -> RigState:
    """Return a sample; raise BadInputError when it cannot be read, or holds no cart."""
    if topics.CART not in message.name:
        raise BadInputError(
            f"joint_states: expected a joint named {topics.CART}, found {list(message.name)}"
        )
    return RigState(*from_joint_state(message).tolist())


def serve(node: ExcitationNode, stopped: StopRequest) -> str | None:
    """Serve the node until it is done or stopped is set.

    Returns why the plan was not played to its end; None when it was.
    """
    spin(node, stopped, lambda: node.over)
    return node.end()


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    return run(
        "excitation_node",
        "Play a plan to rig and twin.",
        ExcitationSettings,
        ExcitationNode,
        arguments,
        serve,
    )


if __name__ == "__main__":
    sys.exit(main())

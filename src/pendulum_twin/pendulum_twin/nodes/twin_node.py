"""Run the live twin: commands in, samples out, by the same names and types as the rig.

`pendulum_twin.paces` says which sample answers which command, in real time and in lockstep.

In real time `applied_pwm` is published half a period after the sample from which on it is held; a
reset shows in the next sample.

In lockstep each accepted command brings one `applied_pwm` (it, clipped) and then one sample,
stamped with simulated time. `/clock` follows the samples, at most 100 times a second of wall time,
never ahead of them, and at the latest 10 ms behind. A reset publishes one sample, the start state,
and answers with its stamp (`pendulum_twin.reset_answer`); time goes on, and commands still waiting
are dropped. Messages without a listener are lost, the first sample among them. So a user begins,
early or late, like this: when publisher and subscriber know each other, call `reset` and take
samples until the stamp is that of the answer; if it does not come, call `reset` again. From then
on, send a command, and take its sample before sending the next command; the sample is a period
younger than the last. Commands of a user who does not wait queue up, ten at most.

In real time the samples follow an even clock and are stamped with the system's time. With
`use_sim_time` they follow `/clock`, which another node has to publish; while it does not, the
twin stands still and says so.

The cart stops at the ends of the rail, and `/diagnostics` says so.

Setting the parameter `twin` replaces the twin while it runs; its measured state stays (see
`LiveTwin.become`).
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Bool, Float64
from std_srvs.srv import Trigger

from pendulum_twin import topics
from pendulum_twin.compile_ahead import prepare_kernel
from pendulum_twin.emergency_stop import StopAnswer
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health
from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.clock_watch import ClockWatch
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.direct import DirectSubscription
from pendulum_twin.nodes.guard import guard_method
from pendulum_twin.nodes.qos import LATCHED, LATEST, SAMPLES
from pendulum_twin.nodes.running import LONGEST_WAIT_S, run, spin
from pendulum_twin.nodes.settings import declare_settings, watch_settings
from pendulum_twin.nodes.sim_clock import CLOCK_PERIOD_S, SimClock
from pendulum_twin.nodes.twin_outlet import TwinOutlet
from pendulum_twin.nodes.twin_settings import TwinSettings
from pendulum_twin.paces import Lockstep, RealTime
from pendulum_twin.reset_answer import format_answer
from pendulum_twin.steady_time import SteadyTime
from pendulum_twin.stop_request import StopRequest
from pendulum_twin.twin_health import TwinFigures, TwinHealth

RESET_STOPPED = (
    "The reset was not begun: the emergency stop is latched. Clear it, then reset again."
)


class TwinNode(Node):
    """Run a twin; in lockstep the node needs `serve`.

    Raises BadInputError when a parameter or the twin file is wrong.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("twin", **options)
        try:
            self._settings = settings = declare_settings(self, TwinSettings)
            twin = load_twin(settings.twin)
        except BadInputError:
            self.destroy_node()
            raise
        period_s = 1 / settings.rate_hz
        self._lock = Lock()  # in lockstep commands have a thread of their own
        self._live = LiveTwin(twin, period_s, settings.command_timeout_s)
        self._sim_clock = SimClock(self) if settings.lockstep else None
        self._commands = (
            DirectSubscription(self, Float64, topics.PWM, SAMPLES) if settings.lockstep else None
        )
        self._steady = None if settings.lockstep or self._is_time_simulated() else SteadyTime()
        to_stamp = self._steady.to_stamp if self._steady else int
        self._outlet = TwinOutlet(self, twin.rig, self._sim_clock, to_stamp)
        self._stopped = self.create_publisher(Bool, topics.STOPPED, LATCHED)
        self._stopped.publish(Bool(data=False))
        self._pace = (Lockstep if settings.lockstep else RealTime)(
            self._live, period_s, self._outlet
        )
        self._health = TwinHealth()
        if not settings.lockstep:
            self.create_subscription(Float64, topics.PWM, self.on_command, LATEST)
            clock = Clock(clock_type=ClockType.STEADY_TIME) if self._steady else self.get_clock()
            self._sampling = self.create_timer(period_s, self.on_timer, clock=clock)
            self._settling = self.create_timer(period_s / 2, self.on_settling, clock=clock)
        self._time_watch = ClockWatch(self) if self._is_time_simulated() else None
        self.create_service(Trigger, topics.RESET, self.on_reset)
        self.create_service(Trigger, topics.STOP, self.on_stop)
        self.create_service(Trigger, topics.CLEAR_STOP, self.on_clear_stop)
        watch_settings(self, lambda: self._settings, self._accept)
        publish_health(self, lambda: "twin", self._report_health)
        pace = "in lockstep, in steps of 1 s /" if settings.lockstep else "at"
        self.get_logger().info(
            f"twin {twin.name} of {settings.twin} runs {pace} {settings.rate_hz:g} Hz"
        )

    @property
    def lockstep(self) -> bool:
        """Return whether simulated time waits for commands."""
        return self._settings.lockstep

    def count_figures(self) -> TwinFigures:
        """Return the counts up to now."""
        live, pace = self._live, self._pace
        taken, refused, age_s = (
            live.commands.taken,
            live.commands.refused,
            live.commands.compute_age_s(self._read_time_ns()),
        )
        return TwinFigures(
            live.twin.name,
            pace.samples,
            taken,
            refused,
            pace.lost,
            live.applied,
            age_s,
            live.impacts,
            live.last_impact,
            live.commands.stop.latched,
            self._time_watch.trouble if self._time_watch else "",
        )

    def fail_safe(self) -> None:
        """Hold no command."""
        self._live.commands.clear()

    @guard_method
    def on_timer(self) -> None:
        """Publish what is due: in real time usually one sample, in lockstep the first."""
        with self._lock:
            self._pace.tick(self._read_time_ns())
        if not self.lockstep:
            self._settling.reset()  # half a period from now
            if self._pace.samples == 1:
                self._sampling.reset()  # the timer counts from the first sample, as the stamps do

    @guard_method
    def on_settling(self) -> None:
        """Settle the last sample's command, half a period after it was published."""
        self._settling.cancel()
        with self._lock:
            self._pace.settle(self._read_time_ns())

    @guard_method
    def on_command(self, message: Float64) -> None:
        """Take a command in real time."""
        with self._lock:
            self._take(message)

    @guard_method
    def answer(self) -> bool:
        """Answer the oldest command of lockstep and return True; False when none waits."""
        with self._lock:
            message = None if self._commands is None else self._commands.take()
            if message is not None:
                self._take(message)
            return message is not None

    def wait(self) -> None:
        """Wait for the next command of lockstep, for LONGEST_WAIT_S at most."""
        if self._commands is not None and self._sim_clock is not None:
            with self._lock:
                behind = self._sim_clock.catch_up()
            self._commands.pause(CLOCK_PERIOD_S if behind else LONGEST_WAIT_S)

    @guard_method
    def on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Start again, hanging at rest in the middle of the rail, unless the stop is latched."""
        with self._lock:
            if self._live.commands.stop.latched:
                response.success, response.message = False, RESET_STOPPED
                return response
            if self._commands is not None:
                self._commands.clear()
            stamp_ns = self._pace.reset()
        response.success, response.message = True, format_answer(stamp_ns)
        return response

    @guard_method
    def on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Latch the emergency stop: PWM is 0 from the next sample on."""
        with self._lock:
            answer = self._live.commands.press_stop(self._read_time_ns())
        return self._answer_stop(answer, response)

    @guard_method
    def on_clear_stop(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Clear the emergency stop, or say why it stays."""
        with self._lock:
            answer = self._live.commands.clear_stop(self._read_time_ns())
        return self._answer_stop(answer, response)

    def _answer_stop(self, answer: StopAnswer, response: Trigger.Response) -> Trigger.Response:
        self._stopped.publish(Bool(data=self._live.commands.stop.latched))
        response.success = answer is not StopAnswer.ZERO_FIRST
        response.message = answer.value
        return response

    def _is_time_simulated(self) -> bool:
        """Return whether the samples are to follow `/clock`; in lockstep they make it."""
        return not self._settings.lockstep and bool(self.get_parameter("use_sim_time").value)

    def _take(self, message: Float64) -> None:
        if not self._pace.take_command(message.data, self._read_time_ns()):
            self.get_logger().warning(
                f"{topics.PWM}: expected a finite number, found {message.data} "
                f"({self._live.commands.refused} refused so far)",
                throttle_duration_sec=1.0,
            )

    def _accept(self, settings: TwinSettings) -> None:
        """Go on with another twin file, or raise BadInputError with nothing changed."""
        twin = load_twin(settings.twin)
        with self._lock:
            self._pace.settle(self._read_time_ns())  # the present period is the former twin's
            self._live.become(twin)
            self._outlet.show(twin.rig)
            self._settings = settings
        self.get_logger().info(f"twin {twin.name} of {settings.twin} goes on")

    def _report_health(self) -> Health:
        return self._health.report(self.count_figures())

    def _read_time_ns(self) -> int:
        if self.lockstep:
            return time.monotonic_ns()
        return self._steady.read_ns() if self._steady else int(self.get_clock().now().nanoseconds)


def serve(node: TwinNode, stopped: StopRequest) -> None:
    """Serve the node until stopped is set; in lockstep the commands have this thread."""
    if not node.lockstep:
        spin(node, stopped)
        return
    with ThreadPoolExecutor(1, "services") as pool:
        services = pool.submit(spin, node, stopped)
        services.add_done_callback(lambda _: stopped.set())
        try:
            node.on_timer()
            while not stopped.is_set():
                node.wait()
                node.answer()
        finally:
            stopped.set()
        services.result()


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    return run(
        "twin_node",
        "The digital twin, in real time or in lockstep.",
        TwinSettings,
        TwinNode,
        arguments,
        serve,
        prepare_kernel,
    )


if __name__ == "__main__":
    sys.exit(main())

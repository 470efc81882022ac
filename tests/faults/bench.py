"""The bench of the faults: the driver's program, the wire, the rig emulator, and a user."""

import math
import select
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from support.driven_rig import MODULE, User, figures
from support.ros_graph import DEADLINE_S, Graph, until
from support.running_emulator import TWIN, start
from support.wire import LOOPBACK, Sent, Wire, untouched

from pendulum_bridge.safety.reasons import Reason

STAYS_S = 0.3  # PWM that is 0 for so long counts as 0 for good
BUSY_S = 0.5  # more than is right, for a machine that does other things too
EVERY_S = 0.01  # from command to command
PUSH = 0.1  # PWM fraction
SWITCH_S = 0.0005  # so that the wire's thread notes times to within about so much
COMMANDER = Path(__file__).with_name("commander.py")
Step = Callable[[], None]


class Bench:
    """Drive an emulated rig over a wire that sees all; the modules beside this make the faults."""

    def __init__(self, ros: Graph, **values: object) -> None:
        sys.setswitchinterval(SWITCH_S)
        self.ros, self.wire, self._values = ros, Wire(), values
        self._due_s = 0.0
        self._commanders: list[subprocess.Popen] = []
        self.rig = self.driver = None
        try:
            self.start_rig()
            self.start_driver()
            self.user = User(ros)
            self._parameters = self.user.node.create_client(SetParameters, "driver/set_parameters")
            self.user.meet()
        except BaseException:
            self.close()
            raise

    def start_rig(self) -> None:
        wire = self.wire
        addresses = (
            "--listen",
            f"{LOOPBACK}:{wire.emulator_port}",
            "--send",
            f"{LOOPBACK}:{wire.user_port}",
        )
        self.rig = start("--twin", str(TWIN), *addresses)
        assert select.select([self.rig.stdout], [], [], DEADLINE_S)[0], (
            "the emulator never said that it is ready"
        )

    def start_driver(self) -> None:
        self.driver = self.ros.start(MODULE, *driver_arguments(self.wire, **self._values))

    def commander(self, *arguments: object) -> subprocess.Popen:
        """Start a program that commands; it says so when it begins."""
        command = [sys.executable, str(COMMANDER), *map(str, arguments)]
        program = subprocess.Popen(
            command, env=self.ros.environment, stdout=subprocess.PIPE, text=True
        )
        self._commanders.append(program)
        return program

    def close(self) -> None:
        for program in (*self._commanders, *((self.rig,) if self.rig else ())):
            program.kill()
            program.wait()
            program.stdout.close()
        self.wire.close()

    # what the user does, a moment at a time

    def idle(self) -> None:
        """Only listen."""
        self.ros.spin()

    def drive(self) -> None:
        """Push back and forth about the middle."""
        self.send(self.wave())

    def send(self, pwm: float) -> None:
        """Command, when it is time to, and listen."""
        if (now := time.monotonic()) >= self._due_s:
            self._due_s = now + EVERY_S
            self.user.send(pwm)
        self.ros.spin()

    def wave(self, size: float = PUSH, way: int = 1) -> float:
        """Return the push that goes back and forth about the middle.

        way: -1 where a positive command moves the measured cart the negative way.
        """
        state = self.user.states[-1]
        back = way * (3 * state.position[0] + state.velocity[0])
        return math.copysign(size, math.cos(math.tau * time.monotonic() / 0.8) - back)

    # from fault to fault

    def ready(self) -> None:
        """Drive, whatever the last fault has left."""
        self.wire.spoil = untouched
        self.user.healths.clear()
        if not self._drives(2.0):
            self.clear()
            assert self._drives(DEADLINE_S), f"it does not drive: {self.sentences}"
        self.user.healths.clear()
        before = len(self.user.states)
        self.until(lambda: len(self.user.states) > before + 20, "some samples", self.drive)

    def recovers(self) -> None:
        """Drive once more, without anybody's help."""
        self.wire.spoil = untouched
        assert self._drives(DEADLINE_S), f"it does not drive again: {self.sentences}"

    def clear(self) -> None:
        """Look at the rig, stop, command 0 and clear the stop."""
        self.wire.spoil = untouched
        assert self.user.call("stop").success
        cleared = Reason.STOP_CLEARED.sentence
        self.spin(0.1, lambda: self.send(0.0))
        self.until(
            lambda: self.user.call("clear_stop").message == cleared,
            "the stop to be cleared",
            lambda: self.send(0.0),
        )

    def _drives(self, within_s: float) -> bool:
        begin = time.monotonic()
        while time.monotonic() < begin + within_s:
            self.drive()
            if sum(abs(sent.pwm) == PUSH for sent in self.wire.since(begin)) > 10:
                return True
        return False

    # oracles

    def until(self, done: Callable[[], Any], what: str, step: Step | None = None) -> Any:
        return until(done, what, step or self.idle)

    def spin(self, seconds: float, step: Step | None = None) -> None:
        """Go on for so long."""
        end = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= end, f"{seconds} s", step)

    def zero_after(self, begin: float, limit_s: float, step: Step | None = None) -> float:
        """Return the time from begin until PWM was 0 for good; fail after limit_s and BUSY_S."""

        def rests() -> bool:
            at_s = zero_at(self.wire.since(begin))
            return at_s is not None and time.monotonic() > at_s + STAYS_S

        self.until(rests, "PWM 0", step)
        zero_s = (zero_at(self.wire.since(begin)) or math.nan) - begin
        assert zero_s <= limit_s + BUSY_S, (
            f"PWM 0 after {zero_s:.3f} s, expected within {limit_s} s"
        )
        return zero_s

    def goes_on(self, begin: float, seconds: float = 1.0, step: Step | None = None) -> list[Sent]:
        """Go on for a while and return what the rig got; fail when it mostly was not driven."""
        self.spin(seconds, step or self.drive)
        sent = self.wire.since(begin)
        driven = sum(sent_command.pwm != 0 for sent_command in sent)
        assert driven > 0.5 * len(sent) > 10, (
            f"of {len(sent)} commands {len(sent) - driven} were 0: {self.sentences}"
        )
        return sent

    @property
    def sentences(self) -> list[str]:
        return list(dict.fromkeys(health.message for health in self.user.healths))

    def said(self, *expected: Reason, step: Step | None = None) -> str:
        """Return the first of these sentences that the driver says since this fault began.

        The driver of a busy computer says before it that the computer stood still.
        """
        wanted = tuple(reason.sentence for reason in expected)

        def list_said() -> list[str]:
            return [s for sentence in self.sentences for s in wanted if sentence.endswith(s)]

        try:
            self.until(list_said, "it", step)
        except AssertionError as error:
            raise AssertionError(f"expected one of {wanted}, found {self.sentences}") from error
        return list_said()[0]

    def counted(self, name: str, step: Step | None = None) -> float:
        """Return a figure of the next health."""
        before = len(self.user.healths)
        self.until(lambda: len(self.user.healths) > before, "health", step)
        return figures(self.user.healths[-1])[name]

    def set(self, **values: object) -> str:
        """Set parameters of the running driver; return why not, empty when done."""
        parameters = [
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
        answer = self.ros.call(self._parameters, SetParameters.Request(parameters=parameters))
        return "; ".join(result.reason for result in answer.results if not result.successful)


def driver_arguments(wire: Wire, **values: object) -> list[str]:
    """Return the arguments that make the module a driver at the wire's end."""
    given = {"twin": TWIN, "rig_port": wire.rig_port, "listen_port": wire.driver_port, **values}
    return [
        "--ros-args",
        *(word for name, value in given.items() for word in ("-p", f"{name}:={value}")),
    ]


def zero_at(sent: list[Sent]) -> float | None:
    """Return when PWM became 0 and has been since (monotonic, s); None when it has not."""
    since_s = None
    for sent_command in reversed(sent):
        if sent_command.pwm != 0:
            break
        since_s = sent_command.at_s
    return since_s

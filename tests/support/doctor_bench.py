"""An emulated rig on its own clock, as fast as it goes, for `rig_doctor`; faults can be added."""

from collections.abc import Callable, Iterable
from pathlib import Path

from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.findings import Finding
from pendulum_bridge.doctor.wire import Heard
from pendulum_bridge.emulator.live_rig import LiveRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_bridge.wire.udp import Address
from pendulum_twin.model import Twin, load_twin

TWIN = load_twin(Path(__file__).parents[2] / "config" / "inteco.yaml")
Shown = Callable[[Sample], bytes]


class Bench:
    """A wire to a rig; its clock moves on only while somebody waits for a sample.

    twin: the rig as it truly is. shown: bytes of a sample. heard: whether a command arrives, by
    its number. sent: all commands. furthest_m: how far from the middle the cart was seen.
    """

    def __init__(
        self,
        twin: Twin = TWIN,
        shown: Shown = Sample.pack,
        obeys: Callable[[Command], Command] = lambda command: command,
        encoders: Encoders = Encoders(),  # noqa: B008 (frozen)
        rate_hz: float = 100.0,
    ) -> None:
        self.rig = LiveRig(Concealed(twin.effects, twin.rig), rate_hz, encoders)
        self._shown, self._obeys = shown, obeys
        self._time_s, self._count = 0.0, 0
        self.sent: list[Command] = []
        self.silent_from_s = float("inf")
        self.foreign = 0
        self.stranger: Address | None = None
        self.trouble = ""
        self.furthest_m = 0.0

    def now(self) -> float:
        return self._time_s

    def send(self, command: Command) -> None:
        self.sent.append(command)
        self.rig.take(self._obeys(command))

    def receive(self, deadline: float) -> Heard | None:
        due_s = (self._count + 1) * self.rig.period_s
        if due_s > deadline:
            self._time_s = max(deadline, self._time_s)
            return None
        self._time_s, self._count = due_s, self._count + 1
        sample = self.rig.step()
        self.furthest_m = max(self.furthest_m, abs(sample.cart_m))
        return Heard(self._shown(sample), due_s) if due_s < self.silent_from_s else None

    @property
    def pwm(self) -> float:
        """Return the last command."""
        return self.sent[-1].pwm if self.sent else 0.0


def faults(findings: Iterable[Finding]) -> set[Fault]:
    """Return what is wrong by these findings."""
    return {each.fault for each in findings if each.fault is not None}


def lines(findings: Iterable[Finding]) -> str:
    return "\n".join(each.line for each in findings)


def failed(findings: Iterable[Finding]) -> list[Finding]:
    return [each for each in findings if each.verdict is Verdict.FAIL]

"""Rigs for the excitation node: a rig that moves only when it is answered, or two live twins."""

from pathlib import Path

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from pendulum_bridge.excitation.guard import StopReason
from pendulum_bridge.excitation.run import Stage
from pendulum_bridge.nodes.excitation_node import ExcitationNode
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.messages import to_joint_state
from pendulum_twin.nodes.qos import LATCHED, SAMPLES
from pendulum_twin.nodes.twin_node import TwinNode
from pendulum_twin.plans.plan_file import Plan, save_plan
from pendulum_twin.plans.plan_phases import Phase, Push, Rest, Samples
from pendulum_twin.stepper import Stepper
from support.ros_graph import DEADLINE_S, Graph

TWIN = Path(__file__).parents[2] / "config" / "inteco.yaml"
RATE_HZ = 100.0
PERIOD_NS = round(1e9 / RATE_HZ)
BUSY_S = 60.0  # so long this machine may stand still in a test that is not about that
NUMBERED = Samples(commands=tuple(np.arange(1, 101) * 1e-3), centred=False)
PUSHED = Samples(commands=(0.3,) * 600, centred=False)
LONG = (Push(seconds=0.9), Rest(seconds=60))


def written(folder: Path, *phases: Phase) -> str:
    """Write a plan file and return its path."""
    save_plan(Plan(phases, rate_hz=RATE_HZ), folder / "plan.yaml")
    return str(folder / "plan.yaml")


def make(ros: Graph, plan: str, **values: object) -> ExcitationNode:
    patient = {"silence_s": BUSY_S, "ready_timeout_s": DEADLINE_S, "reset_timeout_s": DEADLINE_S}
    return ros.add(ExcitationNode, **{"twin_file": str(TWIN), "plan": plan, **patient, **values})


class StepRig:
    """A rig that moves when it is answered: only the order of samples and commands matters.

    Samples whose number is in `lost` are never sent, and what was answered last acts on.
    """

    def __init__(self, ros: Graph, lost: frozenset[int] = frozenset()) -> None:
        node = ros.user("rig", "/rig")
        self._ros, self._lost = ros, lost
        self._stepper = Stepper(load_twin(TWIN), 1 / RATE_HZ)
        self._states = node.create_publisher(JointState, "joint_states", SAMPLES)
        self._applied = node.create_publisher(Float64, "applied_pwm", SAMPLES)
        node.create_publisher(JointState, "/twin/joint_states", SAMPLES)  # as a twin does
        self._stamp_ns, self._command = 0, 0.0
        self.answers: list[float] = []
        self.twins: list[float] = []
        self.states: list[np.ndarray] = []
        node.create_subscription(
            Float64, "pwm", lambda message: self.answers.append(message.data), 100
        )
        node.create_subscription(
            Float64, "/twin/pwm", lambda message: self.twins.append(message.data), 100
        )

    @property
    def now_s(self) -> float:
        """The rig's own time, s, for a node that judges how evenly its first push was sent."""
        return self._stamp_ns / 1e9

    def look(self, node: ExcitationNode) -> None:
        """Hang still and send samples until the node has seen its rate and answered all."""
        self._ros.until(lambda: self._tick() or node._run.stage is Stage.LOOKING, "the look")
        self._tick()
        self._ros.until(
            lambda: node._run.stamps_ns[-1:] == (self._stamp_ns,), "the samples on their way"
        )
        count = len(node._run.stamps_ns)
        self._ros.until(lambda: len(self.answers) == len(self.twins) == count, "their answers")
        while node._run.stage is Stage.LOOKING:
            self.move(-1)

    def _tick(self) -> None:
        self._stamp_ns += PERIOD_NS
        self._states.publish(to_joint_state(["cart", "pole"], self._stepper.state, self._stamp_ns))
        self._applied.publish(Float64(data=self._command))

    def move(self, number: int) -> None:
        """Let a period pass, show the sample (unless it is lost), and wait for its answer."""
        self._stepper.step(self._command)
        self.states.append(self._stepper.state)
        if number in self._lost:
            self._stamp_ns += PERIOD_NS
            return
        before = len(self.answers)
        self._tick()
        self._ros.until(
            lambda: min(len(self.answers), len(self.twins)) > before,
            f"the answers to sample {number}",
        )
        self._command = self.answers[-1]


class Bench:
    """Two live twins, one of them as the rig, and who watches them."""

    def __init__(self, ros: Graph, rig_file: Path = TWIN, rig_rate_hz: float = RATE_HZ) -> None:
        self.ros = ros
        self.rig = ros.add(TwinNode, "/rig", twin=str(rig_file), rate_hz=rig_rate_hz)
        self.twin = ros.add(TwinNode, "/twin", twin=str(TWIN), rate_hz=RATE_HZ)
        self.user = user = ros.user()
        self.sent: dict[str, list[float]] = {"/rig": [], "/twin": []}
        self.carts: list[float] = []
        self.progress: list[float] = []
        for name, kept in self.sent.items():
            user.create_subscription(
                Float64, f"{name}/pwm", lambda m, kept=kept: kept.append(m.data), 1000
            )
        user.create_subscription(
            JointState, "/rig/joint_states", lambda m: self.carts.extend(m.position[:1]), 100
        )
        user.create_subscription(
            Float64, "progress", lambda m: self.progress.append(m.data), LATCHED
        )

    def play(self, plan: str, **values: object) -> ExcitationNode:
        """Start the node and wait until it plays; node and watcher are listened to by then."""
        node = make(self.ros, plan, **{"listeners": 2, "overruled_s": 60.0, **values})
        self.ros.until(
            lambda: node._run.stage in (Stage.PLAYING, Stage.DONE, Stage.STOPPED), "the plan"
        )
        return node

    def over(self, node: ExcitationNode) -> StopReason | None:
        """Wait for the end, check the last 0 for both, and return why it came early, or None."""
        self.ros.until(lambda: node.over, "the end")
        self.ros.until(
            lambda: self.sent["/rig"][-1:] == self.sent["/twin"][-1:] == [0.0],
            "a last command of 0",
        )
        return node._run.stopped.reason if node._run.stopped else None

"""A rig for `driver_node`: the emulator, and a user who commands and listens."""

import select
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64
from std_srvs.srv import Trigger

from pendulum_bridge.nodes.driver_node import DriverNode
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.nodes.qos import LATCHED
from support.ros_graph import DEADLINE_S, Graph, until
from support.running_emulator import LONG_S, TWIN, free_ports, start, udp_socket

MODULE = "pendulum_bridge.nodes.driver_node"
HOST = "127.0.0.1"


class DrivenEmulator:
    """A running `rig_emulator` whose samples go to a driver's port, or over TCP."""

    def __init__(self, *arguments: object, tcp: bool = False) -> None:
        self.rig_port, self.listen_port = free_ports()
        way = ("--tcp",) if tcp else ("--send", f"{HOST}:{self.listen_port}")
        addresses = ("--twin", str(TWIN), "--listen", f"{HOST}:{self.rig_port}", *way)
        self.process = start(*addresses, *map(str, arguments))
        try:
            assert select.select([self.process.stdout], [], [], LONG_S)[0], (
                "it never said that it is ready"
            )
            assert "listens on" in self.process.stdout.readline()
        except BaseException:
            self.kill()
            raise

    @property
    def ports(self) -> dict[str, int]:
        return {"rig_port": self.rig_port, "listen_port": self.listen_port}

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


class RawRig:
    """A rig that is a bare socket: it hears commands, and sends a sample when told to."""

    def __init__(self) -> None:
        self.rig_port, self.listen_port = free_ports()
        self._socket = udp_socket()
        self._socket.bind((HOST, self.rig_port))
        self._socket.settimeout(DEADLINE_S)

    @property
    def ports(self) -> dict[str, int]:
        return {"rig_port": self.rig_port, "listen_port": self.listen_port}

    def send(self, sample: Sample) -> None:
        self._socket.sendto(sample.pack(), (HOST, self.listen_port))

    def hear(self) -> Command:
        """Return the next command; fail at the deadline."""
        return Command.unpack(self._socket.recv(64))

    def heard(self) -> list[Command]:
        """Return all commands that wait."""
        commands = []
        while select.select([self._socket], [], [], 0)[0]:
            commands.append(self.hear())
        return commands

    def close(self) -> None:
        self._socket.close()


class User:
    """Send commands to a driver and keep all that it says."""

    def __init__(self, ros: Graph) -> None:
        self.ros, self.node = ros, ros.user()
        self.states: list[JointState] = []
        self.applied: list[
            tuple[int, float]
        ] = []  # when published (ns, system clock), PWM fraction
        self.healths: list[DiagnosticStatus] = []
        self.stopped: list[bool] = []
        self.sender = self.writer(self.node)
        node = self.node
        node.create_subscription(JointState, "joint_states", self.states.append, 1000)
        node.create_subscription(Float64, "applied_pwm", self._on_applied, 1000)
        node.create_subscription(
            DiagnosticArray, "/diagnostics", lambda m: self.healths.extend(m.status), 10
        )
        node.create_subscription(Bool, "stopped", lambda m: self.stopped.append(m.data), LATCHED)
        self.clients = {
            name: node.create_client(Trigger, name) for name in ("reset", "stop", "clear_stop")
        }
        self.until = ros.until

    def _on_applied(self, message: Float64, info: dict[str, Any]) -> None:
        self.applied.append((info["source_timestamp"], message.data))

    @staticmethod
    def writer(node: Node) -> Any:
        return node.create_publisher(Float64, "pwm", 1)

    @property
    def pwm(self) -> float:
        """Return what was applied last; NaN before anything was."""
        return self.applied[-1][1] if self.applied else float("nan")

    def meet(self) -> None:
        """Return when samples come, what is applied is heard, and commands go."""
        self.until(
            lambda: self.states and self.applied and self.sender.get_subscription_count(),
            "the driver",
        )

    def send(self, pwm: float) -> None:
        self.sender.publish(Float64(data=pwm))

    def more(self, count: int) -> None:
        wanted = len(self.states) + count
        self.until(lambda: len(self.states) >= wanted, f"{count} samples")

    def hold(self, pwm: float, samples: int) -> None:
        """Command the same for so many samples."""
        for _ in range(samples):
            self.send(pwm)
            self.more(1)

    def holding(self, pwm: float, done: Any, what: str) -> None:
        """Command the same until something is the case."""

        def step() -> None:
            self.send(pwm)
            self.ros.spin()

        until(done, what, step)

    def call(self, name: str) -> Trigger.Response:
        return self.ros.call(self.clients[name])

    def ask(self, name: str) -> Any:
        """Call a service without waiting; return the future answer."""
        self.until(self.clients[name].service_is_ready, name)
        return self.clients[name].call_async(Trigger.Request())

    def told(self, sentence: str, level: int) -> DiagnosticStatus:
        """Return the first health from now on that says so, at that level."""
        self.healths.clear()

        def found() -> list[DiagnosticStatus]:
            return [h for h in self.healths if sentence in h.message and h.level == bytes([level])]

        self.until(found, f"health: {sentence}")
        return found()[0]


def figures(health: DiagnosticStatus) -> dict[str, float]:
    """Return the figures that are numbers."""
    return {pair.key: float(pair.value) for pair in health.values if pair.key != "link"}


def make_driver(ros: Graph, rig: DrivenEmulator | RawRig, **values: object) -> DriverNode:
    """Return a driver in this process, active."""
    node = ros.add(DriverNode, **{"twin": str(TWIN), **rig.ports, **values})
    node.start()
    return node


def arguments_for(rig: DrivenEmulator | RawRig, **values: object) -> list[str]:
    """Return the arguments that make the module a driver of this rig."""
    given = {"twin": TWIN, **rig.ports, **values}
    return [
        "--ros-args",
        *(word for name, value in given.items() for word in ("-p", f"{name}:={value}")),
    ]

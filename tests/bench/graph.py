"""The twin on the ROS graph: lockstep steps a second, and how evenly the real-time twin publishes.

Each figure stands beside the bare graph's: the same messages, quality of service and ways of
waiting, with no twin.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "bench")]

from graph_peers import RATE_HZ, Echo  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rows import Row, format_table  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from support.ros_graph import Graph, graph, until  # noqa: E402

from pendulum_twin import topics  # noqa: E402
from pendulum_twin.nodes.direct import DirectSubscription  # noqa: E402
from pendulum_twin.nodes.messages import from_time  # noqa: E402
from pendulum_twin.nodes.qos import LATEST, SAMPLES  # noqa: E402
from pendulum_twin.nodes.twin_node import TwinNode, serve  # noqa: E402

TWIN = str(TESTS.parent / "config" / "inteco.yaml")
REPEATS = 7
DEADLINE_S = 5.0
TWIN_NODE, PEERS = "pendulum_twin.nodes.twin_node", "graph_peers"


class User:
    """Send commands, each after the answer to the last.

    work: what answers them, where no other thread does.
    """

    def __init__(
        self, ros: Graph, namespace: str, work: Callable[[], object] = lambda: None
    ) -> None:
        node = Node("user", namespace=namespace, context=ros.context)
        self._pwm = node.create_publisher(Float64, topics.PWM, LATEST)
        self._samples = DirectSubscription(node, JointState, topics.JOINT_STATES, SAMPLES)
        self._work = work
        until(lambda: self._step(0.1), f"the first answer of {namespace}", lambda: None)
        while self._samples.wait(0.3) is not None:  # answers to the steps before
            pass

    def steps_per_s(self, count: int) -> float:
        begin = time.perf_counter()
        for _ in range(count):
            if not self._step(DEADLINE_S):
                raise RuntimeError(f"expected an answer within {DEADLINE_S} s, found none")
        return count / (time.perf_counter() - begin)

    def _step(self, deadline_s: float) -> bool:
        self._pwm.publish(Float64(data=0.1))
        self._work()
        return self._samples.wait(deadline_s) is not None


def measure_rates(what: str, mark: int, twin: User, bare: User, steps: int) -> Row:
    """Return the median rates of twin and bare graph, which take turns."""
    taken = [(twin.steps_per_s(steps), bare.steps_per_s(steps)) for _ in range(REPEATS)]
    ours, theirs = (statistics.median(side) for side in zip(*taken, strict=True))
    what = f"lockstep steps/s, {what} (mark {mark:,})"
    return Row(what, f"{ours:,.0f}", "bare round trip", f"{theirs:,.0f}", ours / theirs)


def bench_two_processes(steps: int) -> Row:
    """Lockstep steps between two processes."""
    with graph() as ros:
        ros.start(
            TWIN_NODE,
            "--ros-args",
            "-r",
            "__ns:=/twin",
            "-p",
            f"twin:={TWIN}",
            "-p",
            "lockstep:=true",
        )
        ros.start(PEERS, "echo")
        return measure_rates("two processes", 4_000, User(ros, "twin"), User(ros, "bare"), steps)


def serve_lockstep_twin(ros: Graph) -> TwinNode:
    values = [Parameter("twin", value=TWIN), Parameter("lockstep", value=True)]
    return TwinNode(context=ros.context, namespace="twin", parameter_overrides=values)


@contextmanager
def run_threads(*work: Callable[[Event], None]) -> Iterator[None]:
    """Run functions in threads of their own, until the end of the block."""
    stopped = Event()
    running = [Thread(target=each, args=(stopped,)) for each in work]
    for each in running:
        each.start()
    try:
        yield
    finally:
        stopped.set()
        for each in running:
            each.join()


def bench_one_process(steps: int) -> list[Row]:
    """Lockstep steps within one process."""
    with graph() as ros:
        twin, echo = (
            serve_lockstep_twin(ros),
            Echo(Node("echo", namespace="bare", context=ros.context)),
        )
        with run_threads(lambda stopped: serve(twin, stopped), echo.serve):
            two = measure_rates(
                "one process, two threads", 15_000, User(ros, "twin"), User(ros, "bare"), steps
            )
    with graph() as ros:
        twin, echo = (
            serve_lockstep_twin(ros),
            Echo(Node("echo", namespace="bare", context=ros.context)),
        )
        one = measure_rates(
            "one process, one thread",
            15_000,
            User(ros, "twin", twin.answer),
            User(ros, "bare", echo.answer),
            steps,
        )
    return [two, one]


def list_published(samples: DirectSubscription) -> Iterator[tuple[int, int]]:
    """Yield stamp and time of publication, ns, of what came."""
    while (taken := samples._handle.take_message(JointState, False)) is not None:
        message, about = taken
        yield from_time(message.header.stamp), about["source_timestamp"]


def bench_jitter(seconds: float) -> list[Row]:
    """How evenly the real-time twin publishes."""
    with graph() as ros:
        ros.start(
            TWIN_NODE,
            "--ros-args",
            "-r",
            "__ns:=/twin",
            "-p",
            f"twin:={TWIN}",
            "-p",
            f"rate_hz:={RATE_HZ}",
        )
        ros.start(PEERS, "timer")
        node = Node("listener", context=ros.context)
        both = [
            DirectSubscription(node, JointState, f"{name}/joint_states", SAMPLES)
            for name in ("twin", "bare")
        ]
        for samples in both:
            until(lambda samples=samples: samples.wait(0.1), "samples", lambda: None)
        times: list[list[tuple[int, int]]] = [[], []]
        end = time.monotonic() + seconds + 1.0
        while time.monotonic() < end:
            both[0].pause(0.02)
            for kept, samples in zip(times, both, strict=True):
                kept += list_published(samples)
    twin, bare = (
        np.array(each[round(RATE_HZ / 2) :]) / 1e6 for each in times
    )  # ms; after the start
    uneven = [np.abs(np.diff(each[:, 1]) - 1e3 / RATE_HZ) for each in (twin, bare)]
    late = [np.abs(each[:, 1] - each[:, 0]) for each in (twin, bare)]
    return [
        *make_jitter_rows(f"|interval - {1e3 / RATE_HZ:g} ms|", *uneven),
        *make_jitter_rows("|published - stamp|", *late),
    ]


def make_jitter_rows(what: str, ours: np.ndarray, theirs: np.ndarray) -> list[Row]:
    rows = []
    for name, share in (("p50", 50), ("p99", 99), ("max", 100)):
        a, b = np.percentile(ours, share), np.percentile(theirs, share)
        rows.append(
            Row(
                f"{what} at {RATE_HZ:g} Hz, {name}",
                f"{a:.3f} ms",
                "bare timer",
                f"{b:.3f} ms",
                b / a,
            )
        )
    return rows


def measure(steps: int, jitter_s: float) -> list[Row]:
    """Return all rows."""
    rows = [bench_two_processes(steps), *bench_one_process(2 * steps)]
    return rows + bench_jitter(jitter_s) if jitter_s > 0 else rows


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--steps",
        type=int,
        default=3000,
        help="lockstep steps between two processes, in each repeat",
    )
    parser.add_argument(
        "--jitter", type=float, default=60.0, help="seconds of the real-time twin; 0 for none"
    )
    options = parser.parse_args()
    begin = time.perf_counter()
    print(format_table(measure(options.steps, options.jitter)))
    print(
        f"\nMedians of {REPEATS}, taken in turns; jitter over {options.jitter:g} s. "
        f"{time.perf_counter() - begin:.0f} s."
    )


if __name__ == "__main__":
    main()

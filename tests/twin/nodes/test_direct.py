"""A subscription without an executor in its loop."""

import time
from threading import Event, Thread

import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from pendulum_twin.nodes.direct import DirectSubscription  # noqa: E402
from pendulum_twin.nodes.qos import SAMPLES  # noqa: E402

DEADLINE_S = 120.0  # for a message that was sent: a machine may stand still meanwhile


@pytest.fixture
def pair(ros):
    node, other = ros.user("listener"), ros.user("sender")
    direct = DirectSubscription(node, Float64, "numbers", SAMPLES)
    sender = other.create_publisher(Float64, "numbers", SAMPLES)
    ros.until(lambda: sender.get_subscription_count() and direct.publishers, "discovery")
    return direct, sender


def test_messages_come_in_order_each_once(pair) -> None:
    direct, sender = pair
    for value in range(5):
        sender.publish(Float64(data=float(value)))
    assert [direct.wait(DEADLINE_S).data for _ in range(5)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert direct.take() is None


def test_a_wait_ends_at_its_deadline(pair) -> None:
    begin = time.monotonic()
    assert pair[0].wait(0.1) is None
    assert time.monotonic() - begin >= 0.1


def test_a_wait_ends_when_a_message_comes(pair) -> None:
    direct, sender = pair
    thread = Thread(target=lambda: sender.publish(Float64(data=1.0)))
    thread.start()
    assert direct.wait(DEADLINE_S).data == 1.0
    thread.join()


def test_what_waits_can_be_thrown_away(ros, pair) -> None:
    direct, sender = pair
    for _ in range(3):
        sender.publish(Float64())
    counts: list[int] = []

    def clear_all() -> bool:
        counts.append(direct.clear())
        return sum(counts) == 3

    ros.until(clear_all, "three messages that were thrown away")
    assert direct.take() is None
    assert direct.clear() == 0


def test_an_executor_serves_the_rest_of_the_node_and_is_not_woken(
    ros, pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    direct, sender = pair
    node, ours = ros.user("user"), SingleThreadedExecutor(context=ros.context)
    listener = next(n for n in ros.executor.get_nodes() if n.get_name() == "listener")
    served = listener.create_service(Trigger, "ask", lambda request, response: response)
    ros.executor.remove_node(listener)
    ours.add_node(listener)
    wakes, nodes = [], ours.get_nodes
    monkeypatch.setattr(ours, "get_nodes", lambda: (wakes.append(1), nodes())[1])
    stopped = Event()
    thread = Thread(
        target=lambda: [ours.spin_once(timeout_sec=0.05) for _ in iter(stopped.is_set, True)]
    )
    thread.start()
    try:
        assert ros.call(node.create_client(Trigger, served.srv_name)) is not None
        before, begin = len(wakes), time.monotonic()
        for value in range(300):
            sender.publish(Float64(data=float(value)))
            assert direct.wait(DEADLINE_S).data == value
        assert (
            len(wakes) - before < 30 + 2 * (time.monotonic() - begin) / 0.05
        )  # its own timeouts, nothing for messages
    finally:
        stopped.set()
        thread.join()
        ours.shutdown()

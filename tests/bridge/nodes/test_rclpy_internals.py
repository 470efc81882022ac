"""What the nodes use of rclpy beyond its documentation: an upgrade that changes it shows here."""

from typing import Any

import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.serialization import deserialize_message  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_twin.nodes.direct import UntouchedGroup  # noqa: E402

STAMPS = ("source_timestamp", "received_timestamp")


def test_a_subscriptions_handle_gives_bytes_and_their_info_without_an_executor(ros: Graph) -> None:
    """`Subscription.handle.take_message` and `CallbackGroup.can_execute`, used by `raw_topics`."""
    node, called = ros.user(), []
    listening = node.create_subscription(
        Float64, "x", called.append, 10, callback_group=UntouchedGroup(), raw=True
    )
    sender = node.create_publisher(Float64, "x", 10)
    ros.until(sender.get_subscription_count, "discovery")
    handle = listening.handle
    with handle:
        assert handle.take_message(listening.msg_type, True) is None  # nothing has come
        sender.publish(Float64(data=0.25))
        sender.publish(Float64(data=0.5))
        taken: list[Any] = []

        def take() -> bool:
            taken.append(handle.take_message(listening.msg_type, True))
            return sum(entry is not None for entry in taken) == 2

        ros.until(take, "both messages")
    messages = [entry for entry in taken if entry is not None]
    assert [deserialize_message(data, Float64).data for data, _ in messages] == [0.25, 0.5]
    assert all(isinstance(data, bytes) for data, _ in messages)
    assert all(info[stamp] > 0 for _, info in messages for stamp in STAMPS)
    assert [info["publication_sequence_number"] for _, info in messages] == [1, 2]
    assert called == []  # the executor has spun all the while


def test_a_callback_of_two_arguments_gets_the_info_of_its_message(ros: Graph) -> None:
    """The keys of the info that `driver_node` and `watch_node` use."""
    node, heard = ros.user(), []

    def on_message(message: Float64, info: dict[str, Any]) -> None:
        heard.append((message.data, info))

    node.create_subscription(Float64, "x", on_message, 10)
    sender = node.create_publisher(Float64, "x", 10)
    ros.until(sender.get_subscription_count, "discovery")
    sender.publish(Float64(data=0.25))
    ros.until(lambda: heard, "the message")
    data, info = heard[0]
    assert (data, info["publication_sequence_number"]) == (0.25, 1)
    assert info["source_timestamp"] > 0


def test_what_publishers_offer_is_told_by_the_graph(ros: Graph) -> None:
    """The fields of `TopicEndpointInfo` that `raw_topics` uses."""
    node = ros.user()
    node.create_publisher(Float64, "x", 10)
    ros.until(lambda: node.get_publishers_info_by_topic("x"), "the publisher")
    (publisher,) = node.get_publishers_info_by_topic("x")
    assert publisher.topic_type == "std_msgs/msg/Float64" and any(publisher.endpoint_gid)
    assert str(publisher.topic_type_hash).startswith("RIHS01_")


def test_a_client_forgets_a_request_and_an_executor_is_woken(ros: Graph) -> None:
    """`Client.remove_pending_request` (`trigger_call`) and `Executor.wake` (`driver_node`)."""
    client = ros.user().create_client(Trigger, "nobody")
    pending = client.call_async(Trigger.Request())
    client.remove_pending_request(pending)
    client.remove_pending_request(pending)  # once more does nothing
    assert not pending.done()
    ros.executor.wake()
    assert "nobody" in client.service_name and client.srv_name == "nobody"

"""What is used of rclpy beyond its documented interface is there: `direct.py`, `running.py`."""

import importlib

import pytest

pytest.importorskip("rclpy")
from std_msgs.msg import Float64


@pytest.mark.parametrize(
    ("module", "name", "user"),
    [
        ("rclpy.impl.implementation_singleton", "rclpy_implementation", "nodes/direct.py"),
        ("rclpy.event_handler", "SubscriptionEventCallbacks", "nodes/direct.py"),
        ("rclpy._rclpy_pybind11", "RCLInvalidROSArgsError", "nodes/running.py"),
        ("rclpy._rclpy_pybind11", "UnknownROSArgsError", "nodes/running.py"),
    ],
)
def test_rclpy_has_the_private_names_that_are_used(module, name, user):
    try:
        there = hasattr(importlib.import_module(module), name)
    except ImportError:
        there = False
    assert there, f"rclpy has no {module}.{name}: see {user}"


def test_a_wait_set_waits_for_a_subscription():
    from rclpy.impl.implementation_singleton import rclpy_implementation

    wait_set = getattr(rclpy_implementation, "WaitSet", None)
    assert wait_set is not None, "rclpy_implementation has no WaitSet: see nodes/direct.py"
    for name in ("clear_entities", "add_subscription", "wait"):
        assert hasattr(wait_set, name), f"WaitSet has no {name}: see DirectSubscription.pause"


def test_a_callback_group_says_what_an_executor_may_serve():
    from rclpy.callback_groups import CallbackGroup

    for name in ("can_execute", "beginning_execution", "ending_execution"):
        assert hasattr(CallbackGroup, name), f"CallbackGroup has no {name}: see nodes/direct.py"


def test_a_subscription_has_a_handle_from_which_messages_are_taken(ros):
    sender, listener = ros.user("sender"), ros.user("listener")
    subscription = listener.create_subscription(Float64, "number", lambda message: None, 10)
    publisher = sender.create_publisher(Float64, "number", 10)
    ros.executor.remove_node(listener)
    assert hasattr(subscription.handle, "take_message"), (
        "a subscription's handle has no take_message: see DirectSubscription.take"
    )
    ros.until(publisher.get_subscription_count, "discovery")
    publisher.publish(Float64(data=2.0))
    message, about = ros.until(
        lambda: subscription.handle.take_message(Float64, False), "the message"
    )
    assert message.data == 2.0
    assert "source_timestamp" in about, (
        "take_message tells no source_timestamp: see pendulum_bridge.nodes.raw_topics"
    )
    ros.executor.add_node(listener)

"""A node's health goes out once a second, also when it cannot be told."""

import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray
from support.ros_graph import Graph

from pendulum_twin import topics
from pendulum_twin.health import Health, Level
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.qos import SAMPLES


def test_a_health_that_cannot_be_told_is_an_error_and_the_node_lives_on(ros: Graph) -> None:
    answers = [Health(Level.OK, "all is well"), None, Health(Level.OK, "all is well again")]
    heard: list = []
    node = ros.user("speaker", "/lab")
    ros.user().create_subscription(
        DiagnosticArray, topics.DIAGNOSTICS, lambda message: heard.extend(message.status), SAMPLES
    )
    ros.until(lambda: node.count_subscribers(topics.DIAGNOSTICS), "the listener")
    publish_health(node, lambda: "rig", lambda: answers.pop(0) if len(answers) > 1 else answers[0])
    ros.until(lambda: any("again" in status.message for status in heard), "the node to live on")
    (error,) = [status for status in heard if status.level == bytes([Level.ERROR])]
    assert error.message.startswith("The health of /lab/speaker could not be told: ")
    assert (error.name, error.hardware_id) == ("/lab/speaker", "rig")

"""A plan that is given up while the rig is reset: the driver goes on, and the answer says so."""

import math

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.callback_groups import ReentrantCallbackGroup  # noqa: E402
from rclpy.task import Future  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.excitation_bench import LONG, PERIOD_NS, make, written  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_bridge.excitation.run import Stage  # noqa: E402
from pendulum_bridge.nodes.excitation_node import ExcitationNode  # noqa: E402
from pendulum_twin.nodes.messages import to_joint_state  # noqa: E402
from pendulum_twin.nodes.qos import LATEST, SAMPLES  # noqa: E402

HANGING = np.array([0.0, np.pi, 0.0, 0.0])
GOES_ON = "the reset of /rig goes on until it hangs at rest, /rig/stop ends it at once"


class SlowRig:
    """A rig that hangs still, and whose reset takes until `rest` is set."""

    def __init__(self, ros: Graph) -> None:
        self._ros, node = ros, ros.user("driver", "/rig")
        self._states = node.create_publisher(JointState, "joint_states", SAMPLES)
        self._applied = node.create_publisher(Float64, "applied_pwm", SAMPLES)
        node.create_subscription(Float64, "pwm", lambda message: None, LATEST)
        self.rest, self._stamp_ns = Future(), 0
        node.create_service(
            Trigger, "reset", self._on_reset, callback_group=ReentrantCallbackGroup()
        )

    async def _on_reset(self, request, response):
        await self.rest
        response.success = True
        return response

    def bring_to_reset(self, node: ExcitationNode) -> None:
        """Send samples, each when the node has seen the one before, until it waits for a reset."""
        self._ros.until(
            lambda: (
                self._states.get_subscription_count() and self._applied.get_subscription_count()
            ),
            "the listener",
        )
        seen_s = math.nan

        def step() -> str:
            nonlocal seen_s
            if node._run.sampled_s != seen_s:
                seen_s = node._run.sampled_s
                self._tick()
            return node._resetting.describe_pending()

        self._ros.until(step, "the reset")

    def _tick(self) -> None:
        self._stamp_ns += PERIOD_NS
        self._states.publish(to_joint_state(["cart", "pole"], HANGING, self._stamp_ns))
        self._applied.publish(Float64(data=0.0))


def test_an_abort_amid_a_reset_says_that_the_rig_goes_on(ros: Graph, tmp_path) -> None:
    rig = SlowRig(ros)
    node = make(ros, written(tmp_path, *LONG), twin="", exit_when_done=False)
    rig.bring_to_reset(node)
    assert node._run.stage is Stage.RESETTING
    abort = ros.user().create_client(Trigger, "abort")
    assert ros.call(abort).message == f"the plan is aborted; {GOES_ON}"
    assert GOES_ON in ros.call(abort).message  # there is nothing more to abort
    rig.rest.set_result(None)
    ros.until(lambda: not node._resetting.describe_pending(), "the rest")
    assert ros.call(abort).message.startswith("nothing to abort: the node")
    assert GOES_ON in node.end()


def test_a_signal_amid_a_reset_says_so_too(ros: Graph, tmp_path) -> None:
    rig = SlowRig(ros)
    node = make(ros, written(tmp_path, *LONG), twin="")
    rig.bring_to_reset(node)
    assert node.end() == f"The plan was interrupted by a signal (resets rig and twin; {GOES_ON})."

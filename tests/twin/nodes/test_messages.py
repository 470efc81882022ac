"""Numbers become messages, and messages numbers, without a loss."""

import numpy as np
import pytest

pytest.importorskip("rclpy")
from sensor_msgs.msg import JointState
from support.twin_rigs import CART_ALONE, POLE_ALONE, THESIS

from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.messages import (
    from_joint_state,
    from_time,
    list_joints,
    to_float,
    to_joint_state,
    to_time,
)

STATE = np.array([0.1, 3.0, -0.2, 0.4])


@pytest.mark.parametrize("stamp_ns", [0, 1, 10**9 - 1, 10**9, 1_700_000_000_123_456_789])
def test_a_time_goes_into_a_stamp_and_back(stamp_ns):
    assert from_time(to_time(stamp_ns)) == stamp_ns


@pytest.mark.parametrize(
    ("rig", "joints"),
    [(THESIS, ["cart", "pole"]), (CART_ALONE, ["cart"]), (POLE_ALONE, ["pole"])],
    ids=["cart and pole", "cart alone", "pole alone"],
)
def test_a_state_goes_into_the_joints_that_there_are_and_back(rig, joints):
    assert list_joints(rig) == joints
    message = to_joint_state(joints, STATE, 5)
    assert list(message.name) == joints
    assert from_time(message.header.stamp) == 5
    there = np.array(["cart" in joints, "pole" in joints] * 2)
    assert from_joint_state(message).tolist() == np.where(there, STATE, 0.0).tolist()


def test_joints_may_come_in_any_order_beside_others():
    message = JointState(
        name=["pole", "wheel", "cart"], position=[3.0, 7.0, 0.1], velocity=[0.4, 7.0, -0.2]
    )
    assert from_joint_state(message).tolist() == STATE.tolist()


@pytest.mark.parametrize(
    ("message", "sentence"),
    [
        (JointState(name=["wheel"], position=[1.0], velocity=[1.0]), "joints named cart or pole"),
        (JointState(name=["cart"], position=[1.0]), "a position and a velocity for each"),
        (
            JointState(name=["cart"], position=[float("nan")], velocity=[0.0]),
            "expected finite numbers",
        ),
    ],
    ids=["other joints", "no velocity", "not a number"],
)
def test_a_message_that_is_no_state_is_refused_in_a_sentence(message, sentence):
    with pytest.raises(BadInputError, match=sentence):
        from_joint_state(message)


def test_a_number_goes_into_a_message():
    assert to_float(np.float64(0.25)).data == 0.25

"""A callback that fails brings PWM to 0, and the node lives on."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")
from std_srvs.srv import Trigger

from pendulum_twin.nodes.guard import guard_method


class Node:
    """Fail in every callback; remember what was logged."""

    def __init__(self, running: bool = True) -> None:
        self.context = SimpleNamespace(ok=lambda: running)
        self.pwm = 0.3
        self.errors: list[str] = []

    def fail_safe(self) -> None:
        self.pwm = 0.0

    def get_logger(self) -> SimpleNamespace:
        return SimpleNamespace(error=lambda text, **_: self.errors.append(text))

    @guard_method
    def on_message(self, message: object) -> None:
        raise ValueError("bad message")

    @guard_method
    def on_service(self, request: object, response: object) -> object:
        raise ValueError("bad request")

    @guard_method
    def on_timer(self) -> str:
        return "done"


def test_a_callback_that_works_returns_its_own_answer():
    node = Node()
    assert node.on_timer() == "done"
    assert node.pwm == 0.3


def test_a_callback_that_fails_brings_pwm_to_0_and_says_so():
    node = Node()
    assert node.on_message(object()) is None
    assert node.pwm == 0.0
    assert node.errors == ["on_message failed, PWM is 0: ValueError('bad message')"]


def test_a_service_that_fails_answers_so():
    answer = Node().on_service(Trigger.Request(), Trigger.Response())
    assert not answer.success
    assert "bad request" in answer.message


def test_nothing_is_logged_when_ros_has_ended():
    node = Node(running=False)
    assert node.on_message(object()) is None
    assert node.errors == []

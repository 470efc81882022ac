"""Keep a lifecycle node alive when a transition cannot be made."""

from __future__ import annotations

from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode


def guard_transitions(node: LifecycleNode) -> None:
    """Let a transition that the node's state does not allow be answered with success: false.

    rclpy raises in the callback of the service, which would end the node.
    """
    service = node._service_change_state
    change = service.callback

    def answer_request(request: ChangeState.Request, response: ChangeState.Response) -> Any:
        try:
            return change(request, response)
        except Exception as error:
            state = node._state_machine.current_state[1]
            transition = request.transition.label or request.transition.id
            node.get_logger().error(
                f"transition {transition}: expected one that leads out of the state {state}: "
                f"{str(error).splitlines()[0]}"
            )
            response.success = False
            return response

    service.callback = answer_request

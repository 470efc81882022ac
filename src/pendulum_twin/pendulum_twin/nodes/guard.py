"""Keep a node alive when a callback fails: an exception that leaves a callback ends the node."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from std_srvs.srv import Trigger


def guard_method(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a method of a node that has `fail_safe()`, which brings PWM to 0.

    When the method raises, the node fails safe and logs the error; a service (two arguments)
    answers that it failed.
    """

    @wraps(callback)
    def run(node: Any, *arguments: Any) -> Any:
        try:
            return callback(node, *arguments)
        except Exception as error:
            if not node.context.ok():
                return None
            node.fail_safe()
            node.get_logger().error(
                f"{callback.__name__} failed, PWM is 0: {error!r}", throttle_duration_sec=1.0
            )
            return (
                Trigger.Response(success=False, message=repr(error))
                if len(arguments) == 2
                else None
            )

    return run

"""Reset pendulums in order through their services, each within a timeout."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.task import Future

from pendulum_bridge.nodes.pendulum_client import PendulumClient


class ResetSequence:
    """Reset pendulums in order; the next reset begins when the pendulum before hangs at rest.

    failure: why the sequence failed; empty while it has not.
    """

    def __init__(self, pendulums: Sequence[PendulumClient], timeout_s: float) -> None:
        self._left = list(pendulums)
        self._timeout_s = timeout_s
        self._pending: Future | None = None
        self._deadline_s = 0.0
        self.failure = ""

    def done(self, now_s: float) -> bool:
        """Advance the sequence; return whether it is over: with `failure`, or with all at rest.

        now_s: s, monotonic.
        """
        if self._pending is None:
            if not self._left:
                return True
            self._pending, self._deadline_s = self._left[0].reset(), now_s + self._timeout_s
        if self._pending.done():
            answer = self._pending.result()
            self._pending = None
            if not answer.success:
                self.failure = f"{self._left[0].namespace}: {answer.message}"
                return True
            del self._left[0]
            return not self._left
        if now_s > self._deadline_s:
            self.failure = f"{self._left[0].namespace}: no answer within {self._timeout_s:g} s"
        return bool(self.failure)

    def describe_pending(self) -> str:
        """Return that a reset goes on without the sequence, as a clause; empty when none does.

        A rig's driver ends its reset by itself: at rest, at a deadline, or at a stop.
        """
        if self._pending is None or self._pending.done():
            return ""
        name = self._left[0].namespace
        return f"; the reset of {name} goes on until it hangs at rest, {name}/stop ends it at once"

"""Who takes what the driver gives out."""

from __future__ import annotations

from typing import Protocol

from pendulum_bridge.safety.rig_state import RigState


class Outlet(Protocol):
    """Take the driver's output."""

    def publish_sample(self, state: RigState, stamp_ns: int) -> None:
        """Take a sample and its sampling time (ns, system clock)."""

    def publish_applied(self, pwm: float) -> None:
        """Take the command that was sent (PWM fraction)."""

    def publish_stopped(self, latched: bool) -> None:
        """Take whether the emergency stop is latched, after a change."""

    def report_failure(self, error: Exception) -> None:
        """Take an error of the thread that serves the rig."""

"""Say that this computer stood still: a busy computer is no broken rig."""

from __future__ import annotations

NAMED_S = 0.1  # a shorter delay of a program is everyday


def describe_standstill(seconds: float) -> str:
    """Return that this computer stood still for so long, without a full stop."""
    return f"this computer stood still for {1e3 * seconds:.0f} ms"

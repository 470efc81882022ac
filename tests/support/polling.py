"""Wait for what another process or thread does: look again and again, until a deadline."""

import time
from collections.abc import Callable
from typing import Any

DEADLINE_S = 120.0
LOOK_S = 0.01  # between two looks where nothing else is to be done meanwhile


def until(
    done: Callable[[], Any],
    what: str,
    step: Callable[[], Any] = lambda: time.sleep(LOOK_S),
    deadline_s: float = DEADLINE_S,
) -> Any:
    """Repeat step until done returns something true, and return that; fail at the deadline."""
    end = time.monotonic() + deadline_s
    while not (result := done()):
        assert time.monotonic() < end, f"waited {deadline_s} s for {what}"
        step()
    return result

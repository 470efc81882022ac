"""The latency of commands that the recorder kept from the doctor's report."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from pendulum_sysid.records import CommandLatency

KEY = "command_latency"  # in the index's `custom_data`


def read_command_latency(custom: Mapping[str, Any]) -> CommandLatency | None:
    """Return the latency that an index holds; None when it holds none that can be."""
    try:
        figures = json.loads(str(custom.get(KEY, "null")))
        mean_s, spread_s = float(figures["mean_s"]), figures.get("spread_s")
        latency = CommandLatency(mean_s, None if spread_s is None else float(spread_s))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    sizes = (latency.mean_s, latency.spread_s or 0.0)
    return latency if all(math.isfinite(size) and size >= 0 for size in sizes) else None

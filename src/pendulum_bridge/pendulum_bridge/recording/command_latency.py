"""The latency of commands, from the doctor's report, for the recording to keep."""

from __future__ import annotations

import json
import math
from typing import Any

from pendulum_twin.errors import BadInputError
from pendulum_twin.schemas import DOCTOR

KEY = "command_latency"  # in the recording's `custom_data`


def read_command_latency(report: str, path: str) -> dict[str, str]:
    """Return the entry of `custom_data` that a doctor's report gives.

    report: what `rig_doctor --json` printed.
    path: its file, for the message.

    The entry's text is a JSON object: `mean_s`, from a command to the motion that it makes, and,
    where the doctor could tell, `spread_s`, the standard deviation from step to step, and `steps`,
    their number. A report without a measured latency gives no entry.

    Raises BadInputError when the text is no report.
    """
    try:
        content = json.loads(report)
        if content["schema"] != DOCTOR:
            raise ValueError(f"schema {content['schema']!r}")
        figures = [_read_figures(each) for each in content["findings"] if "figures" in each]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise BadInputError(
            f"doctor: expected what rig_doctor --move --json printed, found another file in "
            f"{path} ({error})"
        ) from error
    latencies = [each for each in figures if each]
    return {KEY: json.dumps(latencies[0])} if latencies else {}


def _read_figures(finding: dict[str, Any]) -> dict[str, float]:
    """Return the figures of the check of latency; an empty dictionary for other checks."""
    if (finding["group"], finding["check"]) != ("command", "latency"):
        return {}
    figures = {name: float(value) for name, value in finding["figures"].items()}
    if not all(math.isfinite(value) and value >= 0 for value in figures.values()):
        raise ValueError(f"figures {figures}")
    return figures

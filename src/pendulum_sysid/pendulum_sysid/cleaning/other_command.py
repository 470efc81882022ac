"""Say where the driver sent other commands than the commands that were read."""

from __future__ import annotations

from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans


def detect_other_command(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say where the driver sent other commands, which drove the cart; nothing is changed."""
    sent = samples.raw.sent
    if sent is None:
        return samples, ()
    spans = list_spans(samples.raw.state_stamp_s, find_runs(sent.differ))
    return samples, (Fault("other_command", spans, sent.note),)

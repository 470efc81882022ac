"""What it means that a plan was broken off."""

from __future__ import annotations

from pendulum_bridge.doctor.derivatives import check_order
from pendulum_bridge.doctor.driving import BRAKED, HUNG, JUMPED, SILENT, STOOD, Driven
from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.timing import FEWEST
from pendulum_bridge.doctor.track import gridded

MEANS = {
    SILENT: Fault.FELL_SILENT,
    BRAKED: Fault.MOTION_BROKEN_OFF,
    JUMPED: Fault.JUMPED,
    STOOD: Fault.CART_STANDS,
    HUNG: Fault.POLE_STANDS,
}


def broken_off[Seen](
    check: Check, expected: str, driven: Driven[Seen], period_s: float
) -> Finding:
    """Return the finding of a check whose plan was broken off: what the samples give away, or what ended it."""
    if len(driven.track.arrivals) > FEWEST:
        order = check_order(gridded(driven.track, period_s))
        if order.fault:
            return Finding(check, order.expected, order.found, order.fault)
    return Finding(check, expected, driven.broken_off, MEANS[driven.broken_off])

"""The finding of a check whose plan was broken off."""

from __future__ import annotations

from pendulum_bridge.doctor.derivatives import check_order
from pendulum_bridge.doctor.driving import BRAKED, HUNG, JUMPED, SILENT, STOOD, Driven
from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.timing import FEWEST_SAMPLES
from pendulum_bridge.doctor.track import resample

FAULT_OF_END = {
    SILENT: Fault.FELL_SILENT,
    BRAKED: Fault.MOTION_BROKEN_OFF,
    JUMPED: Fault.JUMPED,
    STOOD: Fault.CART_STANDS,
    HUNG: Fault.POLE_STANDS,
}


def explain_broken_off[Seen](
    check: Check, expected: str, driven: Driven[Seen], period_s: float
) -> Finding:
    """Return the finding of a check whose plan was broken off.

    The fault is a wrong order of the fields when the samples show one, else the end of the plan.
    expected: for the finding, when the samples show no wrong order.
    driven: the plan that was broken off.
    """
    if len(driven.track.arrivals) > FEWEST_SAMPLES:
        order = check_order(resample(driven.track, period_s))
        if order.fault:
            return Finding(check, order.expected, order.observed, order.fault)
    return Finding(check, expected, driven.broken_off, FAULT_OF_END[driven.broken_off])

"""Whether commands act when they come, and not from a sample on: a fitted twin decides.

A driver answers each sample some milliseconds later, and never by the same time. A rig with a
clock of its own takes the answer at a sample; an amplifier that is driven directly takes it at
once, and the cart then moves by the uneven times. A single position hardly shows the difference,
but the cart's speed sums it up. Both readings are fitted with a delay beside, for what all answers
have in common is a delay under either: the unevenness alone decides.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import SLOTS

DELAY = "input_delay"


def take_commands_at_once(
    case: Case, split: Split, effects: tuple[str, ...], theta: Floats
) -> Case:
    """Return the case with commands that act when they come; the case itself if they do not.

    effects, theta: of a twin to fit, (SIZE,).
    """
    at_once = case.recording.at_once
    if at_once is None or case.signals.cart is None:
        return case
    signals = replace(case.signals, command=at_once)
    recording = replace(case.recording, signals=signals, doubt=None, at_once=None)
    moved = replace(case, recording=recording)
    plain, uneven = (_fit_with_delay(each, split, effects, theta) for each in (case, moved))
    lead = compute_lead(uneven, plain)
    return moved if lead.is_real else case


def _fit_with_delay(case: Case, split: Split, effects: tuple[str, ...], theta: Floats) -> Fit:
    """Return a fit with a delay of the command beside the effects, begun at half a period."""
    if DELAY in effects:
        return fit(case, split, effects, theta, HORIZONS[0])
    begun = theta.copy()
    begun[SLOTS[DELAY]] = np.array([0.5 * case.signals.period_s])
    return fit(case, split, (*effects, DELAY), begun, HORIZONS[0])

"""Whether the cart moves before its command: then positions were smoothed, or commands are late.

A filter that averages over past and future samples lets the cart answer commands that have not
been given. The cart's balance is fitted with the commands of the coming 0.12 s beside those of the
past 0.2 s; a rig gives the coming commands no weight, in closed loop neither. A drive with a slew
limit answers in no proportion, so its ramp is looked for first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import (
    compute_covariance,
    differentiate_twice,
    list_other_forces,
)
from pendulum_sysid.cleaning.command_ramp import follow_ramp
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import compute_slow_speed
from pendulum_sysid.errors import UnusableRecording
from pendulum_twin.arrays import Ints
from pendulum_twin.signals import Signals

BIN_S = 0.01  # s; a bin of commands, and the step of the differences
NEXT_BINS = 2  # bins; that differences and the noise in a controller's answer reach ahead
LEAD_BINS, LAG_BINS = 12, 20


@dataclass(frozen=True)
class Lead:
    """Hold the weight of the commands to come.

    share: of the weight of all commands.
    standard_errors: by which it differs from nothing.
    """

    share: float
    standard_errors: float


def check_causality(signals: Signals, state: SmoothState) -> None:
    """Raise UnusableRecording when the cart moves before its command."""
    lead = measure_lead(signals, state)
    if lead is None:
        return
    sure = lead.standard_errors > decisions.LEAD_ANSWER_STANDARD_ERRORS
    if sure and decisions.LEAD_ANSWER_SHARE < lead.share < 1.0:
        raise UnusableRecording(
            f"expected the cart to move after its command, found {lead.share:.0%} of its answer "
            "before: positions that were smoothed, or commands that were stamped late; record "
            "positions as the sensors give them, and commands when they act"
        )


def measure_lead(signals: Signals, state: SmoothState) -> Lead | None:
    """Return the weight of the commands to come; None where it cannot be asked."""
    size = max(round(BIN_S / signals.period_s), 1)
    if signals.cart is None or signals.period_s > 2 * BIN_S or not np.any(signals.command):
        return None
    rows = _choose_rows(signals, state, size)
    places = np.arange(-LEAD_BINS, LAG_BINS + 1)
    if len(rows) < decisions.LEAD_ANSWER_LEAST_ROWS:
        return None
    driving = follow_ramp(signals, state)
    commanded = np.convolve(driving, np.full(size, 1.0 / size))[size - 1 :]
    commands = np.column_stack([commanded[rows - place * size] for place in places])
    columns = np.column_stack([commands, list_other_forces(signals, state, size)[rows]])
    block = (signals.times_s[rows] // decisions.ERROR_BLOCK_S).astype(int)
    commanded_blocks = np.unique(block[np.any(commands, axis=1)])
    if len(commanded_blocks) < decisions.SPREAD_LEAST_BLOCKS:
        return None  # a single push leaves no spread between blocks
    scale = np.sqrt(np.mean(columns**2, axis=0)) + np.finfo(float).tiny
    columns, target = (
        columns / scale,
        differentiate_twice(signals.cart, signals.period_s, size)[rows],
    )
    weights = np.linalg.lstsq(columns, target, rcond=1e-8)[0]
    errors = compute_covariance(columns, target - columns @ weights, block)
    per_unit = np.where(np.arange(len(scale)) < len(places), 1.0 / scale, 0.0)
    coming = per_unit.copy()
    coming[LEAD_BINS - NEXT_BINS :] = 0.0
    total, ahead = float(per_unit @ weights), float(coming @ weights)
    error = float(np.sqrt(coming @ errors @ coming))
    return Lead(ahead / (total or np.inf), abs(ahead) / max(error, 1e-300))


def _choose_rows(signals: Signals, state: SmoothState, size: int) -> Ints:
    """Return samples a bin apart: their commands lie in their stretch, and the cart moves."""
    reach = [(LAG_BINS + 1) * size, (LEAD_BINS + 2) * size]
    inside = [np.arange(s.start + reach[0], s.stop - reach[1], size) for s in signals.stretches]
    rows = np.concatenate(inside).astype(np.int64)
    valid = signals.cart_valid if signals.pole is None else signals.cart_valid & signals.pole_valid
    moves = np.abs(state.states[:, 2]) > compute_slow_speed(state)
    return rows[(valid & moves)[rows] & valid[rows - size] & valid[rows + size]]

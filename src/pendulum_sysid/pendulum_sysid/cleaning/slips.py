"""Find where the cart's reading slips: it goes elsewhere within a moment, and no force took it.

A belt that jumps teeth or a wheel that slides moves the reading, not the cart. The velocity that
the reading shows departs from the velocity that command, brakes and pole give the cart, and comes
back to it exactly: a force would leave the cart with another momentum. Slips are rare; physics
that does the same again and again is no slip. So the command drives the cart through any static
curve, late or not (a saturation is no slip), behind a slew limit or not, with a gain that may
change along the rail and with speed. A slip stands out from the seconds around it, and from the
velocity that the balance gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d, maximum_filter1d, median_filter

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import list_reactions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.command_ramp import follow_ramp
from pendulum_sysid.cleaning.drive_curve import bend_command
from pendulum_sysid.cleaning.earlier_samples import delay_samples
from pendulum_sysid.cleaning.leaving_out import leave_samples_out
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import compute_slow_speed, list_brakes
from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.signals import Signals

STEP_S = 0.01  # s; over which velocities are taken
NOTE = (
    "the cart's reading goes elsewhere and no force took the cart there: a belt that slipped, or "
    "a hand that moved the cart"
)


@dataclass(frozen=True)
class Slip:
    """Hold one slip.

    first, stop: samples; the reading slips between them.
    distance_m: by which the reading is off afterwards.
    """

    first: int
    stop: int
    distance_m: float


def leave_out_slips(recording: Recording, state: SmoothState) -> Recording:
    """Mark the samples of slips as not valid, begin a stretch after each, and add the finding.

    Returns the same recording when nothing slips.
    """
    signals = recording.signals
    slips = find_slips(signals, state)
    if not slips:
        return recording
    margin = max(round(decisions.SLIP_MARGIN_S / signals.period_s), 1)
    around = [(max(slip.first - margin, 0), slip.stop + margin) for slip in slips]
    times = signals.times_s
    spans = tuple((float(times[s.first]), float(times[s.stop - 1])) for s in slips)
    return leave_samples_out(recording, around, QualityFinding("slip", len(slips), spans, NOTE))


def find_slips(signals: Signals, state: SmoothState) -> list[Slip]:
    """Return the slips of the cart's reading; none where more than a few would be claimed."""
    if signals.cart is None or not np.any(signals.command):
        return []
    velocities = _compute_departing_velocity(signals, state)
    if velocities is None or not np.any(velocities[0]):
        return []
    departing, given = velocities
    usual = _measure_usual(np.abs(departing), np.abs(given), signals.period_s)
    standing = _find_standing(signals, state)
    reach = max(round(decisions.SLIP_LONGEST_S / signals.period_s), 1)
    slips = []
    for first, stop in find_runs(np.abs(departing) > decisions.SLIP_VELOCITY_RATIO * usual):
        distance_m = float(np.sum(departing[first:stop])) * signals.period_s
        brief = (stop - first) * signals.period_s < decisions.SLIP_LONGEST_S
        # a cart that stands before and after has broken away and sticks again
        rolls = not (
            standing[max(first - reach, 0) : first].any() and standing[stop : stop + reach].any()
        )
        if brief and rolls and abs(distance_m) > decisions.SLIP_LEAST_M:
            slips.append(Slip(first, stop, distance_m))
    return slips if len(slips) <= decisions.MOST_SLIPS else []


def _measure_usual(departing: Floats, given: Floats, period_s: float) -> Floats:
    """Return how large a departure is usual at each sample, (n,), m/s.

    It is that of the whole recording or of the seconds around, and larger where the balance gives
    the cart more velocity: physics that the balance lacks is off by a share of that.

    departing: (n,) sizes; 0 where unknown.
    given: (n,) sizes of the velocity that the balance gives; 0 where unknown.
    """
    known = departing > 0.0
    size = 2 * round(decisions.SLIP_DRIFT_S / period_s) + 1
    around: Floats = median_filter(departing, size=size, mode="nearest")
    brief = 2 * round(0.5 * decisions.SLIP_LONGEST_S / period_s) + 1
    strong = maximum_filter1d(given, size=brief, mode="nearest")
    overall = np.median(departing[known])
    driven = strong[known & (strong > 0.0)]
    share = overall / np.median(driven) if len(driven) else 0.0
    return 1.4826 * np.maximum(around, np.maximum(overall, share * strong))


def _find_standing(signals: Signals, state: SmoothState) -> Mask:
    """Return at which samples the cart stands for longer than it takes to turn round, (n,)."""
    standing = np.abs(state.states[:, 2]) <= compute_slow_speed(state)
    for first, stop in find_runs(standing):
        if (stop - first) * signals.period_s < decisions.SLIP_STAND_S:
            standing[first:stop] = False
    return standing


def _compute_departing_velocity(
    signals: Signals, state: SmoothState
) -> tuple[Floats, Floats] | None:
    """Return the velocity of the reading beyond that of the balance, and that of the balance.

    Both (n,), m/s, without drift; 0 where unknown.
    """
    assert signals.cart is not None
    size = max(round(STEP_S / signals.period_s), 1)
    brief = np.hanning(2 * max(round(decisions.ANSWER_FILTER_S / signals.period_s) // 2, 2) + 3)
    weights = brief[1:-1] / brief.sum()
    terms = np.column_stack(
        [
            list_drives(follow_ramp(signals, state), signals, state),
            list_brakes(state),
            list_reactions(signals, state),
        ]
    )
    moving = np.abs(state.states[:, 2]) > compute_slow_speed(state)
    rows = np.flatnonzero(moving & signals.cart_valid)[:: max(len(weights) // 4, 1)]
    if len(rows) < decisions.ANSWER_LEAST_ROWS:
        return None
    columns = correlate1d(terms, weights, axis=0, mode="nearest")[rows]
    target = correlate1d(state.accelerations[:, 0], weights, mode="nearest")[rows]
    fitted = np.linalg.lstsq(columns, target, rcond=None)[0]
    left = np.abs(target - columns @ fitted)
    usual = left <= np.quantile(left, 1.0 - decisions.SLIP_TRIMMED)
    fitted = np.linalg.lstsq(columns[usual], target[usual], rcond=None)[0]
    departing, driven = np.zeros(len(signals)), np.zeros(len(signals))
    drift = 2 * round(0.5 * decisions.SLIP_DRIFT_S / signals.period_s) + 1
    for s in signals.stretches:
        if s.stop - s.start <= drift:
            continue
        velocity = np.zeros(s.stop - s.start)
        x = signals.cart[s]
        velocity[size:-size] = (x[2 * size :] - x[: -2 * size]) / (2 * size * signals.period_s)
        velocity[:size], velocity[-size:] = velocity[size], velocity[-size - 1]
        given = np.cumsum(terms[s] @ fitted) * signals.period_s
        inside = slice(drift // 2, -(drift // 2))  # at the ends the drift is unknown
        for result, changing in ((departing, velocity - given), (driven, given)):
            slow = median_filter(changing, size=drift, mode="nearest")
            result[s][inside] = (changing - slow)[inside]
    return departing, driven


def list_drives(command: Floats, signals: Signals, state: SmoothState) -> Floats:
    """Return by what a command may drive the cart, (n, 12).

    Curves of the command, earlier commands, and gains that change along the rail and with speed.

    command: (n,) behind the drive's ramp, PWM fraction.
    """
    late = []
    for late_s in decisions.SLIP_LATE_S:
        samples = max(round(late_s / signals.period_s), 1)
        late.append(delay_samples(command, samples, signals.stretch_begins))
    gains = command[:, None] * np.column_stack([state.states[:, 0], np.abs(state.states[:, 2])])
    bent = bend_command(command, command)
    return np.column_stack([bent, np.abs(command), *late, gains])

"""Find slips of the pole's encoder: steps of the measured angle between two samples.

On either side of every instant a cubic is fitted to a few samples. Where the two cubics, carried
on to the instant, disagree by far more than noise and the motion's own curvature explain, the
angle has stepped (jump points of a curve by one-sided local polynomials; Qiu, Image Processing
and Jump Regression Analysis (2005), chapter 3). Samples that were left out as spikes may lie in
between: a step in fast motion looks like a spike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import encoder_slip
from pendulum_twin.signals import Signals

EFFECT = encoder_slip.EFFECT
DEGREE = 3


@dataclass(frozen=True)
class AngleStep:
    """Hold one step of the measured angle.

    time_s: s, on the clock of the recording; the step lies in the middle of two samples.
    angle_rad: rad, the angle after the step less the angle before it.
    """

    time_s: float
    angle_rad: float


def read_slips(sight: Sight) -> tuple[Reading, ...]:
    """Return steps of the pole's angle as slips of its encoder, the clearest first."""
    steps = find_angle_steps(sight.case.signals, sight.case.state.noise.pole_rad)
    return tuple(Reading(EFFECT.name, (step.angle_rad, step.time_s)) for step in steps)


def find_angle_steps(signals: Signals, noise_rad: float | None) -> tuple[AngleStep, ...]:
    """Return the clearest steps of the pole's angle, at most `SLIPS_TRIED`, the clearest first."""
    if signals.pole is None or noise_rad is None or len(signals) < 4 * decisions.SLIP_SIDE_SAMPLES:
        return ()
    measured = [
        _measure_jumps(signals, noise_rad, width) for width in range(decisions.SLIP_WIDEST_GAP + 1)
    ]
    ranked = sorted(
        (
            (float(clearness[k]), width, int(k))
            for width, (_, clearness) in enumerate(measured)
            for k in np.flatnonzero(clearness > decisions.SURE_STANDARD_ERRORS)
        ),
        reverse=True,
    )
    steps: list[AngleStep] = []
    taken: list[int] = []
    for _, width, k in ranked:
        first = k + decisions.SLIP_SIDE_SAMPLES  # left out, or the first sample after the step
        if (
            len(steps) < decisions.SLIPS_TRIED
            and not _is_near_seam(signals, first)
            and all(abs(first - other) >= 2 * decisions.SLIP_SIDE_SAMPLES for other in taken)
        ):
            half_s = 0.5 * (width + 1) * signals.period_s
            time_s = float(signals.clock_s[first - 1]) + half_s
            steps.append(AngleStep(time_s, float(measured[width][0][k])))
        taken.append(first)
    return tuple(steps)


def _is_near_seam(signals: Signals, at: int) -> bool:
    """Return whether a sample lies where time is missing, or where another recording begins.

    An encoder may be set anew meanwhile. A clear slip begins a new stretch, too, but no time is
    missing there.
    """
    seams, clock_s = np.array(signals.stretch_begins[1:], dtype=np.int64), signals.clock_s
    missing_s = clock_s[seams] - clock_s[seams - 1] - signals.period_s
    seams = seams[np.abs(missing_s) > 0.5 * signals.period_s]
    near = decisions.SLIP_SEAM_S / signals.period_s
    return bool(np.any(np.abs(seams - at) < near))


def _measure_jumps(signals: Signals, noise_rad: float, width: int) -> tuple[Floats, Floats]:
    """Return how far both sides disagree (rad), and the same in deviations of what is usual.

    width: samples that are left out between both sides.
    Both results (places,), and 0 where a side holds samples that do not count.
    """
    assert signals.pole is not None
    reach = 2 * decisions.SLIP_SIDE_SAMPLES + width
    view = np.lib.stride_tricks.sliding_window_view
    valid, times = view(signals.pole_valid, reach), view(signals.clock_s, reach)
    seconds = (reach - 1) * signals.period_s
    even = np.abs(times[:, -1] - times[:, 0] - seconds) < 0.5 * signals.period_s
    before, between, after = (
        valid[:, : decisions.SLIP_SIDE_SAMPLES],
        valid[:, decisions.SLIP_SIDE_SAMPLES : -decisions.SLIP_SIDE_SAMPLES],
        valid[:, -decisions.SLIP_SIDE_SAMPLES :],
    )
    usable = before.all(axis=1) & after.all(axis=1) & ~between.any(axis=1) & even
    weights = _make_weights(width)
    angles = view(signals.pole, reach)
    jump = (
        angles[:, -decisions.SLIP_SIDE_SAMPLES :] @ weights
        - angles[:, : decisions.SLIP_SIDE_SAMPLES] @ weights[::-1]
    )
    jump = np.where(usable, jump, 0.0)
    usual = noise_rad * float(np.sqrt(2 * np.sum(weights**2)))
    if usable.sum() > reach:  # few places say nothing about the motion's usual disagreement
        # by hand: scipy.stats takes 0.4 s to import, and no other part of a diagnosis needs it
        usual = max(usual, 1.4826 * float(np.median(np.abs(jump[usable]))))
    return jump, np.abs(jump) / usual


def _make_weights(width: int) -> Floats:
    """Return the weights that carry samples after a place back to its middle.

    Shape (SLIP_SIDE_SAMPLES,).
    """
    at = np.arange(decisions.SLIP_SIDE_SAMPLES) + 0.5 * (width + 1)
    return np.linalg.pinv(np.vander(at, DEGREE + 1, increasing=True))[0]


DETECTOR = Detector(EFFECT, Use.START, read_slips)

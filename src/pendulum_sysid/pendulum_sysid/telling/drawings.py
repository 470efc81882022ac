"""Collect what a report draws: the whole recording, all windows, what errors still show."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.fitting.window_runs import JOINTS, UNITS, WindowRuns
from pendulum_sysid.records import Overlay, Windows
from pendulum_sysid.telling.outcome import Findings
from pendulum_sysid.telling.residuals import examine_residuals
from pendulum_sysid.verdict.drawn import Drawings, Motion
from pendulum_twin.signals import Signals


def collect_drawings(findings: Findings, held_out: Windows) -> Drawings:
    """Return what a report draws besides the held-out runs."""
    case = findings.case
    at = held_out.begin[:, None] + np.arange(held_out.samples)
    residuals = examine_residuals(
        findings.before["held_out"], findings.after["held_out"], case.signals.command[at]
    )
    return Drawings(
        motion=draw_motion(case.signals, case.state),
        learned=draw_overlays(findings.before["learn"], findings.after["learn"]),
        residuals=residuals,
    )


def draw_overlays(before: WindowRuns, after: WindowRuns) -> tuple[Overlay, ...]:
    """Return the runs of both twins beside what was measured, a channel each.

    Samples that are missing are NaN: their places hold no measurement.
    """
    measured = np.where(after.counts > 0.0, after.measured, np.nan)
    times = after.begin_s[:, None] + after.period_s * np.arange(after.measured.shape[1])
    return tuple(
        Overlay(
            JOINTS[joint],
            UNITS[joint],
            times,
            measured[..., k],
            before.runs[..., k],
            after.runs[..., k],
        )
        for k, joint in enumerate(after.channels)
    )


def draw_motion(signals: Signals, state: SmoothState) -> Motion:
    """Return the whole recording; values that the cleaning left out are NaN."""
    times, period = signals.times_s, signals.period_s
    cart = pole = velocity = rate = None
    used = np.ones(len(signals), dtype=bool)
    if signals.cart is not None:
        used &= signals.cart_valid
        cart, velocity = (
            np.where(signals.cart_valid, values, np.nan)
            for values in (signals.cart, state.states[:, 2])
        )
    if signals.pole is not None:
        used &= signals.pole_valid
        pole, rate = (
            np.where(signals.pole_valid, values, np.nan)
            for values in (signals.pole, state.states[:, 3])
        )
    begins = np.array(signals.stretch_begins[1:], dtype=np.int64)
    breaks = tuple(
        (float(times[k - 1]), float(times[k]))
        for k in begins
        if times[k] - times[k - 1] > 1.5 * period
    )
    return Motion(
        times,
        signals.command,
        cart,
        velocity,
        pole,
        rate,
        left_out_s=times[~used],
        breaks_s=breaks,
    )

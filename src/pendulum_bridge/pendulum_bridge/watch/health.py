"""Describe the watch and the rig, once a second."""

from __future__ import annotations

from pendulum_bridge.watch.alarm import Alarm
from pendulum_bridge.watch.stream import RATE_TOLERANCE
from pendulum_bridge.watch.watch import Phase, Watch
from pendulum_twin.health import Health, Level

SILENT_S = 2.0
Figures = dict[str, float | int | str]


def describe_health(watch: Watch, rig: str, silent_s: float | None) -> Health:
    """Return how the rig is.

    ERROR: a change whose place is known. WARN: a change whose place is in doubt, or nothing can be
    said.

    rig: its namespace.
    silent_s: s since the last sample; None when there was none.
    """
    figures: Figures = {"phase": watch.phase.value, **_list_counts(watch)}
    if watch.alarm is not None:
        level = Level.ERROR if watch.alarm.sure else Level.WARN
        return Health(
            level,
            f"{rig} has changed: {watch.alarm.sentence}",
            {**figures, **_list_figures(watch.alarm)},
        )
    rate_hz, expected_hz = watch.stream.rate_hz, watch.settings.rate_hz
    if silent_s is None or silent_s > SILENT_S:
        return Health(Level.WARN, f"{rig}: no samples{_format_silence(silent_s)}", figures)
    if rate_hz is not None and abs(rate_hz / expected_hz - 1) > RATE_TOLERANCE:
        sentence = (
            f"{rig}: expected samples at {expected_hz:g} Hz, found {rate_hz:.4g} Hz: set rate_hz"
        )
        return Health(Level.ERROR, sentence, figures)
    if watch.phase is Phase.LEARNING:
        sentence = (
            f"{rig}: learns what is usual, {watch.learned_s:g} of {watch.settings.learn_s:g} s of "
            "motion"
        )
        return Health(Level.OK, sentence, figures)
    return Health(Level.OK, f"{rig} moves as its twin says", figures)


def _format_silence(silent_s: float | None) -> str:
    return " yet" if silent_s is None else f" for {silent_s:.1f} s"


def _list_counts(watch: Watch) -> Figures:
    stream, baseline = watch.stream, watch.baseline
    counts: Figures = {
        "samples": stream.samples,
        "lost_samples": stream.lost,
        "late_samples": stream.late,
    }
    if baseline is not None:
        cart, pole = baseline.noise.slack
        counts |= {"usual_scatter_cart": float(cart), "usual_scatter_pole": float(pole)}
    return counts


def _list_figures(alarm: Alarm) -> Figures:
    return {
        "place": alarm.place.value,
        "effect": alarm.effect,
        "variable": alarm.variable,
        "size": alarm.size,
        "low": alarm.low,
        "high": alarm.high,
        "unit": alarm.unit,
        "since": f"{alarm.since_ns * 1e-9:.2f}",
        "raised": f"{alarm.raised_ns * 1e-9:.2f}",
        "confidence": alarm.confidence,
        "not_ruled_out": ", ".join(alarm.others) or "none",
        "explained": "all" if alarm.explained else "part",
    }

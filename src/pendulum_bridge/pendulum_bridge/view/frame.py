"""A moment as the browser gets it: dictionaries for JSON, None for numbers that are not finite."""

from __future__ import annotations

import math
from typing import Any

from pendulum_bridge.view.mismatch import Mismatch, find_mismatch
from pendulum_bridge.view.samples import (
    SILENT_AFTER_S,
    NodeHealth,
    PlanState,
    RecordingState,
    Snapshot,
    Source,
    Stage,
    Word,
    compute_period_ns,
    compute_silence_s,
    is_fresh,
)
from pendulum_twin.topics import JOINT_STATES, UNDER_WAY

LEVELS = ("ok", "warn", "error", "stale")
NODE_SILENT_AFTER_S = 3.0  # health comes once a second
COLUMNS = (
    "time_s",
    *("rig_cart_m", "rig_pole_rad", "rig_pwm", "rig_applied_pwm"),
    *("twin_cart_m", "twin_pole_rad", "twin_pwm", "twin_applied_pwm"),
    *("mismatch_cart_m", "mismatch_pole_rad"),
)

Json = dict[str, Any]


def make_frame(now: Snapshot) -> Json:
    """Return a moment: time, rig, twin, their mismatch, plan, recordings, and nodes' health.

    Rig, twin, mismatch or recordings are None when they are not there.
    """
    apart = (
        find_mismatch(now.rig.samples, now.twin.samples)
        if now.rig and now.twin and _are_both_fresh(now)
        else None
    )
    return {
        "time_s": round_finite(now.now_s),
        "rig": _describe_source(now.rig, now.now_s) if now.rig else None,
        "twin": _describe_source(now.twin, now.now_s) if now.twin else None,
        "mismatch": _describe_mismatch(apart) if apart else None,
        "plan": _describe_plan(now.plan),
        "recordings": None
        if now.recordings is None
        else [_describe_recording(each, now.now_s) for each in now.recordings],
        "nodes": [_describe_node(node, now.now_s) for node in now.nodes],
    }


def make_point(moment: Json) -> list[float | None]:
    """Return a frame's values for the plots; None while a source is silent.

    The order is that of COLUMNS.
    """
    values: list[float | None] = [moment["time_s"]]
    for source in (moment["rig"], moment["twin"]):
        heard = source is not None and source["state"] == "fresh"
        values += [source[key] if heard else None for key in ("cart_m", "pole_rad")]
        values += [source[key] if source else None for key in ("pwm", "applied_pwm")]
    apart = moment["mismatch"]
    return values + [apart[key] if apart else None for key in ("cart_m", "pole_rad")]


def round_finite(value: float | None) -> float | None:
    """Return a number with the digits worth sending; None for NaN and infinity."""
    return None if value is None or not math.isfinite(value) else float(f"{value:.7g}")


def _are_both_fresh(now: Snapshot) -> bool:
    return is_fresh(now.rig, now.now_s) and is_fresh(now.twin, now.now_s)


def _describe_source(source: Source, now_s: float) -> Json:
    last = source.samples[-1] if source.samples else None
    silent_s, period = compute_silence_s(source, now_s), compute_period_ns(source.samples)
    state = "never" if silent_s is None else "fresh" if silent_s <= SILENT_AFTER_S else "stale"
    values = ("cart_m", "pole_rad", "cart_m_s", "pole_rad_s")
    return {
        "namespace": source.namespace,
        "state": state,
        "notice": _word_notice(source, state),
        **{key: round_finite(getattr(last, key)) if last else None for key in values},
        "pwm": _read_word(source.pwm, now_s),
        "applied_pwm": _read_word(source.applied, now_s),
        "silent_s": round_finite(silent_s),
        "stamp_age_s": round_finite(last.age_s + silent_s)
        if last and silent_s is not None
        else None,
        "rate_hz": round_finite(1e9 / period) if period and state == "fresh" else None,
        "stopped": source.stopped,
        "refused": source.refused,
    }


def _read_word(word: Word | None, now_s: float) -> float | None:
    return round_finite(word.value) if word and now_s - word.heard_s <= SILENT_AFTER_S else None


def _word_notice(source: Source, state: str) -> str | None:
    """Return what a person should know of a source, or None.

    The text stays the same as long as its cause lasts, as it may be read aloud.
    """
    if state == "fresh":
        return None
    name, topic = source.namespace, f"{source.namespace.rstrip('/')}/{JOINT_STATES}"
    said = (
        f"No sample of {name} yet: waiting for {topic}."
        if state == "never"
        else f"{name} is silent: its last sample is shown."
    )
    return f"{said} Refused: {source.complaint}." if source.complaint else said


def _describe_mismatch(apart: Mismatch) -> Json:
    return {
        "cart_m": round_finite(apart.cart_m),
        "pole_rad": round_finite(apart.pole_rad),
        "turns": apart.turns,
        "apart_s": round_finite(apart.apart_s),
    }


def _describe_plan(plan: PlanState) -> Json:
    return {
        "offered": plan.offered,
        "playing": plan.offered and plan.outcome == UNDER_WAY,
        "outcome": plan.outcome,
        "share": round_finite(plan.share),
    }


def _describe_recording(recording: RecordingState, now_s: float) -> Json:
    records = recording.stage is Stage.RECORDING
    return {
        "name": recording.name,
        "stage": recording.stage.value,
        "seconds": round_finite(max(now_s - recording.began_s, 0.0)) if records else None,
        "sentence": recording.sentence,
        "share": round_finite(recording.share),
        "outcome": recording.outcome,
        "files": recording.files,
    }


def _describe_node(node: NodeHealth, now_s: float) -> Json:
    silent_s = max(now_s - node.heard_s, 0.0)
    silent = silent_s > NODE_SILENT_AFTER_S
    return {
        "name": node.name,
        "level": "stale" if silent or not 0 <= node.level < len(LEVELS) else LEVELS[node.level],
        "sentence": f"silent; it said last: {node.sentence}" if silent else node.sentence,
        "figures": dict(node.figures),
    }

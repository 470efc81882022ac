"""A history and a comparison in JSON's types."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from pendulum_sysid.fleet.comparison import Comparison
from pendulum_sysid.fleet.history import (
    History,
    Size,
    describe_change,
    describe_drift,
    describe_history,
)

HISTORY_SCHEMA, COMPARISON_SCHEMA = "pendulum_history/1", "pendulum_comparison/1"


def encode_history(history: History) -> dict[str, Any]:
    """Return a rig's history: sentences, changes, drifts and sizes."""
    return {
        "schema": HISTORY_SCHEMA,
        "rig": history.rig,
        "recordings": len(history.recordings),
        "unanswered": len(history.unanswered),
        "sentences": describe_history(history),
        "changes": [
            {
                "size": size.name,
                "unit": size.unit,
                "kind": "drift begins" if change.drifts else "step",
                "before": change.before,
                "after": change.after,
                "first_recording_after": size.rows["path"].iloc[change.index],
                "time": size.rows["time"].iloc[change.index].isoformat(),
                "earliest": size.rows["time"].iloc[change.earliest].isoformat(),
                "latest": size.rows["time"].iloc[change.latest].isoformat(),
                "chance": change.chance,
                "sentence": describe_change(size, change),
            }
            for size, change in history.changes
        ],
        "drifts": [
            {"size": s.name, "chance": s.course.drift_chance, "sentence": describe_drift(s)}
            for s in history.drifts
        ],
        "sizes": {size.name: _encode_size(size) for size in history.sizes},
        "left_out": history.left_out,
    }


def _encode_size(size: Size) -> dict[str, Any]:
    value, low, high = size.next_week
    return {
        "unit": size.unit,
        "recordings": len(size.rows),
        "today": asdict(size.today),
        "next_week": {"value": value, "low": low, "high": high},
        "spread": size.course.spread,
        "factor_of_errors": size.course.factor,
    }


def encode_comparison(comparison: Comparison) -> dict[str, Any]:
    """Return the rigs side by side."""
    return {
        "schema": COMPARISON_SCHEMA,
        "unlike": [asdict(u) for u in comparison.unlike],
        "shared": [asdict(s) for s in comparison.shared],
        "sizes": {
            name: {
                "unit": comparison.units[name],
                "mean": family.mean,
                "low": family.low,
                "high": family.high,
                "between_rigs": family.between,
                "within_rig": family.within,
                "rigs": {
                    rig: asdict(pooled)
                    for rig, pooled in zip(comparison.members[name], family.rigs, strict=True)
                },
            }
            for name, family in comparison.families.items()
        },
    }

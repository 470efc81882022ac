"""Verdicts as `sysid diagnose` writes them, with estimates of the test's choice."""

from collections.abc import Sequence
from typing import Any


def make_missing_entry(
    effect: str,
    inseparable_from: Sequence[str] = (),
    **estimates: tuple[float, float, float],
) -> dict[str, Any]:
    """Return an entry of `missing_physics`; estimates: parameter -> value, low, high in N."""
    parameters = {
        name: {"value": value, "low": low, "high": high, "unit": "N"}
        for name, (value, low, high) in estimates.items()
    }
    return {
        "effect": effect,
        "cannot_be_told_from": list(inseparable_from),
        "confidence": 0.99,
        "parameters": parameters,
    }


def make_verdict(*missing_physics: dict[str, Any], outcome: str = "named") -> dict[str, Any]:
    """Return a verdict with these entries; the cart's viscous friction is 0.44 +- 0.01 N s/m."""
    return {
        "schema": "pendulum_verdict/1",
        "outcome": outcome,
        "sentence": "Dry friction holds the cart back with 0.72 N.",
        "missing_physics": list(missing_physics),
        "rig_parameters": {
            "cart_viscous_n_s_m": {
                "before": 0.5, "after": 0.44, "low": 0.43, "high": 0.45,
                "unit": "N s/m", "identifiable": True,
            },
            "gravity_m_s2": {
                "before": 9.81, "after": 9.81, "low": 0.0, "high": 100.0,
                "unit": "m/s^2", "identifiable": False,
            },
        },
        "masking": ["cart_viscous_n_s_m had absorbed it"],
        "fit": {
            "train": {"before": 30.0, "after": 1.1}, "held_out": {"before": 31.0, "after": 1.2},
            "noise_floor": 1.0, "unit": "score",
        },
    }  # fmt: skip

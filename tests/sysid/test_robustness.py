"""Faults of recording do not change what is named, and are reported."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO, PERIOD_S, hidden

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.raw import RawRecording

EFFECTS = {"cart_coulomb_friction": {"level_n": 0.5}, "input_delay": {"delay_s": 0.023}}
SEED = 5


def raw() -> RawRecording:
    signals = hidden(EFFECTS, SEED)[0].signals
    stamps = np.arange(len(signals)) * PERIOD_S
    return RawRecording(
        "made", "sha256:5", stamps, signals.cart, signals.pole, stamps, signals.command
    )


def with_spikes(one: RawRecording, random: np.random.Generator) -> RawRecording:
    at = random.choice(len(one.state_stamp_s), 30, replace=False)
    cart, pole = one.cart.copy(), one.pole.copy()
    cart[at[:20]] += random.choice([-0.05, 0.05], 20)
    pole[at[10:]] += random.choice([-1.0, 1.0], 20)
    return replace(one, cart=cart, pole=pole)


def with_losses(one: RawRecording, random: np.random.Generator) -> RawRecording:
    kept = random.random(len(one.state_stamp_s)) > 0.05
    return replace(
        one, state_stamp_s=one.state_stamp_s[kept], cart=one.cart[kept], pole=one.pole[kept]
    )


def stamped_wrongly(one: RawRecording, random: np.random.Generator) -> RawRecording:
    """Move the stamps, not the samples."""
    return replace(
        one,
        state_stamp_s=np.sort(
            one.state_stamp_s + random.normal(0.0, 0.002, len(one.state_stamp_s))
        ),
    )


def sampled_unevenly(one: RawRecording, random: np.random.Generator) -> RawRecording:
    """Take the samples at uneven times and stamp them rightly."""
    stamps = np.sort(one.state_stamp_s + random.normal(0.0, 0.002, len(one.state_stamp_s)))
    fine = hidden(EFFECTS, SEED)[0].signals
    knots = np.arange(len(fine)) * PERIOD_S
    from scipy.interpolate import CubicSpline

    return replace(
        one,
        state_stamp_s=stamps,
        cart=CubicSpline(knots, one.cart)(stamps),
        pole=CubicSpline(knots, one.pole)(stamps),
    )


def beginning_with_another_run(one: RawRecording, random: np.random.Generator) -> RawRecording:
    n = 130
    t = np.arange(n) * PERIOD_S
    stamps = np.arange(n + len(one.state_stamp_s)) * PERIOD_S
    return replace(
        one,
        state_stamp_s=stamps,
        command_stamp_s=stamps,
        cart=np.concatenate([0.1 + 0.05 * np.sin(5 * t), one.cart]),
        pole=np.concatenate([3.9 + 0.5 * np.cos(7 * t), one.pole]),
        command=np.concatenate([0.2 * np.sin(6 * t), one.command]),
    )


def wrapped(one: RawRecording, random: np.random.Generator) -> RawRecording:
    return replace(one, pole=np.mod(one.pole + np.pi, 2 * np.pi) - np.pi)


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        (with_spikes, "spike"),
        (with_losses, "gap"),
        (stamped_wrongly, "jitter"),
        (sampled_unevenly, "jitter"),
        (beginning_with_another_run, "stale"),
        (wrapped, "wrap"),
    ],
    ids=lambda one: one if isinstance(one, str) else one.__name__,
)
def test_the_verdict_stays(
    fault: Callable[[RawRecording, np.random.Generator], RawRecording], kind: str
) -> None:
    recording = clean_recording(fault(raw(), np.random.default_rng(1)))
    found = diagnose([recording], INTECO, lambda line: None).to_dict()
    assert found["outcome"] == "named"
    assert {one["effect"] for one in found["missing_physics"]} == set(EFFECTS)
    for one in found["missing_physics"]:
        for name, true in EFFECTS[one["effect"]].items():
            assert one["parameters"][name]["value"] == pytest.approx(true, rel=0.05)
    assert kind in {one["kind"] for one in found["data_quality"]}

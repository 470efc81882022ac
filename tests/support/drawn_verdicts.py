"""Verdicts with everything that a report draws, made without a diagnosis."""

import math
from dataclasses import replace

import numpy as np

from pendulum_sysid.records import Evidence, Localisation, Outcome, Overlay, Trial
from pendulum_sysid.verdict.drawn import (
    Drawings,
    Motion,
    Origin,
    ResidualTest,
)
from pendulum_sysid.verdict.record import Correlations, Verdict
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

RIG = Rig(
    cart_mass_kg=0.5723,
    pole_mass_kg=0.12,
    com_distance_m=0.0196,
    pole_inertia_kg_m2=0.00292,
    force_per_pwm_n=12.4,
    cart_viscous_n_s_m=1.96,
    pole_viscous_n_m_s=2.7e-4,
    rail_half_length_m=0.9,
    pwm_limit=0.5,
)
TWIN = Twin(
    "inteco",
    RIG,
    {"cart_coulomb_friction": {"level_n": 0.46}, "pole_quadratic_drag": {"n_m_s2": 1.3e-5}},
)


def make_constant(before: float, after: float, low: float, high: float, unit: str) -> dict:
    return {
        "before": before, "parameters_alone": before, "after": after, "low": low, "high": high,
        "unit": unit, "identifiable": math.isfinite(low), "at_bound": False,
    }  # fmt: skip


CONTENT = {
    "schema": "pendulum_verdict/1",
    "outcome": "named",
    "sentence": "The twin lacks dry friction of the cart, 0.46 N, and quadratic drag on the pole.",
    "location": {
        "place": "cart",
        "evidence": [{"variable": "cart_velocity", "finding": "a step at zero", "share": 0.83}],
        "intervals_s": [[12.1, 14.0], [31.0, 33.5]],
    },
    "missing_physics": [
        {
            "effect": "cart_coulomb_friction",
            "cannot_be_told_from": [],
            "confidence": 0.9999,
            "parameters": {
                "level_n": {"value": 0.4612, "low": 0.4508, "high": 0.4716, "unit": "N"}
            },
            "sentence": "Dry friction holds the cart back with 0.46 N.",
        },
        {
            "effect": "pole_quadratic_drag",
            "cannot_be_told_from": ["pole_coulomb_friction"],
            "confidence": 0.93,
            "parameters": {
                "n_m_s2": {"value": 1.31e-5, "low": 1.12e-5, "high": 1.5e-5, "unit": "N m s^2"}
            },
            "sentence": "Drag of 1.3e-5 N m s² times the squared rate holds the pole back.",
        },
    ],
    "rig_parameters": {
        "com_distance_m": make_constant(0.0196, 0.0196, math.nan, math.nan, "m"),
        "force_per_pwm_n": make_constant(12.86, 12.41, 12.34, 12.48, "N"),
        "cart_viscous_n_s_m": make_constant(2.84, 1.96, 1.9, 2.02, "N s/m"),
        "pole_viscous_n_m_s": make_constant(2.7344e-4, 1.21e-4, 1.03e-4, 1.39e-4, "N m s/rad"),
        "pole_inertia_kg_m2": make_constant(2.92e-3, 2.92e-3, -math.inf, math.inf, "kg m^2"),
    },
    "masking": [
        "cart_viscous_n_s_m had absorbed the missing cart_coulomb_friction: 2.84 becomes 1.96"
    ],
    "fit": {
        "train": {"before": 47.3, "after": 1.11},
        "held_out": {"before": 49.8, "after": 1.14},
        "held_out_cart_mm": {"before": 45.2, "after": 1.9},
        "held_out_pole_rad": {"before": 0.56, "after": 0.0041},
        "noise_floor": 1.02,
        "unit": "score",
    },
    "remainder": {
        "place": "drive",
        "above_noise_floor": 1.62,
        "finding": "time: the gain sinks by some 4 % in two minutes",
    },
    "data_quality": [
        {"kind": "spike", "count": 3, "intervals_s": [[0.0, 0.01], [7.41, 7.42], [29.0, 29.01]]},
        {"kind": "wrap", "count": 12, "intervals_s": []},
    ],
    "next_experiment": {
        "file": "next.yaml",
        "why": "Slow swings part the pole's dry friction from its drag.",
    },
    "recording": {
        "name": "inteco_60s",
        "seconds": 60.0,
        "samples": 6000,
        "rate_hz": 100.0,
        "digest": "sha256:" + 8 * "0123abcd",
        "position_step_m": 57e-6,
        "angle_step_rad": 0.0015,
    },
    "elapsed_s": 12.04,
}
COMMAND = "sysid diagnose inteco_60s --twin config/inteco.yaml --out out"
TRIALS = (
    Trial((), 14.2, 15.3, "parameters alone"),
    Trial(("rail_tilt",), 14.1, 15.4, "tried"),
    Trial(("motor_lag",), 13.9, 15.1, "tried"),
    Trial(("cart_coulomb_friction",), 2.31, 2.4, "kept"),
    Trial(
        ("cart_coulomb_friction", "pole_coulomb_friction"),
        1.13,
        1.18,
        "as good, cannot be told apart",
    ),
    Trial(("cart_coulomb_friction", "pole_quadratic_drag"), 1.11, 1.15, "kept"),
    Trial(
        ("cart_stribeck_friction", "pole_quadratic_drag"),
        1.11,
        1.15,
        "no better than the simpler one",
    ),
    *(
        Trial(("cart_coulomb_friction", f"other_{k}"), 2.2 + k, 2.3 + k, "tried")
        for k in range(12)
    ),
)


def make_overlay(
    channel: str, unit: str, size: float, off: float, windows: int = 14, rate_hz: int = 200
) -> Overlay:
    """Make runs like those of a rig: after is close, before drifts off the picture at times."""
    rng = np.random.default_rng(1)
    times = 4.0 * np.arange(windows)[:, None] + np.arange(rate_hz + 1) / rate_hz
    since = times - times[:, :1]
    measured = size * np.sin(
        1.7 * times + np.sin(0.9 * times)
    ) + 0.002 * size * rng.standard_normal(times.shape)
    before = measured + off * (1 + np.arange(windows)[:, None] % 3) * since**2
    after = measured + 0.02 * size * np.sin(3 * since)
    return Overlay(channel, unit, times, measured, before, after)


def make_evidence() -> tuple[Evidence, ...]:
    v = np.linspace(-1.2, 1.2, 31)
    step = Evidence(
        "cart_velocity",
        "a step at zero speed",
        0.83,
        v,
        -0.46 * np.tanh(20 * v),
        0.03 + 0.05 * v**2,
    )
    return step, Evidence("cart_position", "no more than chance", 0.04)


ORIGIN = Origin(
    "2026-11-22 06:30:00+00:00",
    "0.1.0",
    ("inteco_60s",),
    "config/inteco.yaml",
    "sha256:77aa",
    "out",
)


def make_drawings() -> Drawings:
    """Make a recording of 60 s at 100 Hz with a gap, windows that were learned on, and tests."""
    t = 0.01 * np.arange(6000.0)
    t[3000:] += 2.0
    wave = np.sin(t)
    pole = np.where(np.arange(6000) == 700, np.nan, np.pi + wave)
    motion = Motion(t, 0.1 * wave, 0.3 * wave, 0.3 * np.cos(t), pole, np.cos(t), t[[700]], (
        (29.99, 32.0),
    ))  # fmt: skip
    lags, lines = 0.01 * np.arange(51), np.arange(1.0, 51.0)
    test = ResidualTest(
        "cart", "m", lags, np.exp(-20 * lags), 0.05, np.concatenate([-lags[:0:-1], lags]),
        np.full(101, 0.02), 0.1, lines, 1e-3 / lines, 1e-5 / lines, 1e-6,
    )  # fmt: skip
    learned = (make_overlay("cart", "m", 0.3, 0.08, 40), make_overlay("pole", "rad", 2.0, 1.5, 40))
    learned = tuple(replace(o, times_s=o.times_s + 1.5) for o in learned)
    return Drawings(motion, learned, (test,))


def make_named() -> Verdict:
    place = Localisation("cart", make_evidence(), ((12.1, 14.0), (31.0, 33.5)))
    overlays = (make_overlay("cart", "m", 0.3, 0.08), make_overlay("pole", "rad", 2.0, 1.5))
    return replace(
        Verdict.from_dict(CONTENT),
        command=COMMAND,
        twin=TWIN,
        localisation=place,
        trials=TRIALS,
        overlays=overlays,
        origin=ORIGIN,
        drawings=make_drawings(),
        correlations=Correlations(
            ("cart_viscous_n_s_m", "cart_coulomb_friction.level_n"),
            ((1.0, -0.97), (-0.97, 1.0)),
        ),
        next_plan={},
    )


def make_ended(outcome: Outcome) -> Verdict:
    """Make a verdict as each outcome leaves it."""
    verdict = replace(make_named(), outcome=outcome, sentence=f"A sentence for {outcome.value}.")
    empty = replace(verdict, missing_physics=(), masking=(), twin=Twin("inteco", RIG))
    match outcome:
        case Outcome.NOTHING_MISSING:
            return replace(empty, location=None, remainder=None)
        case Outcome.NOT_IN_CATALOGUE:
            return empty
        case Outcome.UNUSABLE:
            return replace(make_unusable(), sentence=verdict.sentence)
        case _:
            return verdict


def make_unusable() -> Verdict:
    """Make a verdict in which every field that may be empty is."""
    whole = Verdict.from_dict(CONTENT)
    return Verdict(
        Outcome.UNUSABLE,
        "Too short.",
        None,
        (),
        {},
        (),
        None,
        None,
        (),
        None,
        whole.recording,
        1.0,
    )


def make_hour() -> Verdict:
    """Make a verdict on an hour at 100 Hz with 3600 windows, each quarter of them held out."""
    verdict, n = make_named(), 360_000
    times, wave = 0.01 * np.arange(n), np.sin(0.01 * np.arange(n))
    motion = Motion(times, wave, wave, wave, wave, wave, times[:0])
    assert verdict.drawings is not None
    held_out, learned = (
        tuple(
            make_overlay(*of, 0.1, count, rate_hz=100)
            for of in (("cart", "m", 0.3), ("pole", "rad", 2.0))
        )
        for count in (900, 2700)
    )
    drawings = replace(verdict.drawings, motion=motion, learned=learned)
    return replace(verdict, overlays=held_out, drawings=drawings)

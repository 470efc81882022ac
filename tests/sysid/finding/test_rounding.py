"""A constant of less than half an encoder's step is how counts are rounded, no missing physics."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.rounding import doubt_rounding
from pendulum_sysid.finding.search import search_effects
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Estimate

STEP_RAD = 2.0 * np.pi / 1000
LEAD = Lead(2.0, 9.0)


def make_counted(offset_rad: float = 0.0) -> Prepared:
    """Return a recording whose encoder counts down to whole steps, with its zero off."""
    recording = made(INTECO, seconds=20.0, noise=0.0)
    signals = recording.signals
    pole = STEP_RAD * np.floor((signals.pole + offset_rad) / STEP_RAD)
    cart = 5e-5 * np.rint(signals.cart / 5e-5)
    counted = replace(signals, pole=pole, cart=cart)
    return prepare([replace(recording, signals=counted, pole_step_rad=STEP_RAD)], INTECO)


def test_an_encoder_that_rounds_down_lacks_nothing() -> None:
    """All readings are half a step low, which twenty seconds show to a thirtieth of a step."""
    prepared = make_counted()
    answer = search_effects(prepared.case, prepared.split)
    assert not answer.named


def test_a_zero_that_is_off_by_a_step_is_named() -> None:
    prepared = make_counted(1.5 * STEP_RAD)
    answer = search_effects(prepared.case, prepared.split)
    assert [effect.effect for effect in answer.named] == ["angle_offset"]


@pytest.mark.parametrize(
    ("effect", "ties", "size", "rounding"),
    [
        ("angle_offset", (), -0.5, True),
        ("angle_offset", (), -1.0, False),
        ("angle_scale", ("angle_offset",), -0.5 / np.pi, True),
        ("angle_scale", (), -0.5 / np.pi, False),
        ("pole_spring", ("angle_offset",), -1e-4, False),
    ],
)
def test_only_what_may_be_a_constant_of_half_a_step_is_rounding(
    effect: str, ties: tuple[str, ...], size: float, rounding: bool
) -> None:
    unit = {"angle_offset": "angle_rad", "angle_scale": "ratio", "pole_spring": "n_m_per_rad"}
    estimate = Estimate(size * STEP_RAD, 1.02 * size * STEP_RAD, 0.98 * size * STEP_RAD)
    fit = SimpleNamespace(estimates={f"{effect}.{unit[effect]}": estimate})
    (named,) = doubt_rounding(make_counted().case, fit, [Named(effect, LEAD, ties)])
    assert named.is_rounding is rounding and named.is_lasting is not rounding

"""docs/law_agreement.py: two verdicts share a law between curve and effect otherwise."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from support.paths import ROOT

from pendulum_sysid.records import Outcome
from pendulum_sysid.verdict.record import (
    EffectParameter,
    MeasuredLaw,
    MissingEffect,
    RecordingFacts,
    Verdict,
)
from pendulum_sysid.verdict.scores import BeforeAfter, FitScores

sys.path.append(str(ROOT / "docs"))
from law_agreement import list_agreements

KNOTS = np.linspace(0.0, 6.0, 24)


def make_law(level: float) -> MeasuredLaw:
    values = level + 0.02 * np.sin(KNOTS)
    return MeasuredLaw(
        law="angle_error_over_turn",
        place="sensor",
        variables=("pole_angle",),
        knots=tuple(KNOTS),
        values=tuple(values),
        low=tuple(values - 0.004),
        high=tuple(values + 0.004),
        unit="rad",
        formula="",
        sentence="",
        shape="",
        parameters={},
        effective_parameters=4.0,
    )


def make_verdict(law: MeasuredLaw) -> Verdict:
    scores = BeforeAfter(2.0, 1.0)
    fit = FitScores(train=scores, held_out=scores, noise_floor=1.0)
    facts = RecordingFacts("made", 60.0, 6000, 100.0, "sha256:1", 0.0, 0.0)
    return Verdict(
        Outcome.NOT_IN_CATALOGUE, "", None, (), {}, (), fit, None, (), None, facts, 1.0,
        measured_laws=(law,),
    )  # fmt: skip


def test_a_level_that_an_effect_holds_counts_to_the_law() -> None:
    offset = MissingEffect(
        "angle_offset", (), 0.5, {"angle_rad": EffectParameter(-0.08, -0.083, -0.077, "rad")}, ""
    )
    whole = make_verdict(make_law(-0.08))
    parted = replace(make_verdict(make_law(0.0)), perhaps=(offset,))
    bare = replace(parted, perhaps=())
    verdicts = {"whole": whole, "parted": parted, "bare": bare}
    (agrees,) = list_agreements(verdicts, ("whole", "parted"))
    assert agrees.overlap == 1.0 and agrees.common == 1.0 and agrees.apart == pytest.approx(0.0)
    (differs,) = list_agreements(verdicts, ("whole", "bare"))
    assert differs.overlap == 0.0 and differs.apart == pytest.approx(20.0)

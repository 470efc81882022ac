"""What is believed of a constant is compared with the value that the verdict tells."""

from collections import namedtuple
from dataclasses import replace
from typing import Any

import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.late_command import LATE
from pendulum_sysid.fitting.case import make_case
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.records import Estimate, QualityFinding, Recording
from pendulum_sysid.telling.contradictions import describe_contradictions
from pendulum_sysid.telling.outcome import Findings

BELIEVED = replace(INTECO, spreads={"cart_viscous_n_s_m": 0.01})
RECORDING = made(INTECO, 4.0)
Fit = namedtuple("Fit", "estimates")


def estimate_constants(drag: float) -> Fit:
    """Return a fit whose viscous friction of the cart is sure, in N s/m."""
    values = {c.name: Estimate(c.believed, 0.0, 1e9) for c in list_rig_parameters(BELIEVED)}
    return Fit({**values, "cart_viscous_n_s_m": Estimate(drag, drag - 0.01, drag + 0.01)})


def make_findings(recording: Recording, drag: float) -> Findings:
    """Return findings whose fit with laws has this viscous friction of the cart, N s/m."""
    blank: dict[str, Any] = dict.fromkeys(Findings.__dataclass_fields__)
    return Findings(
        **{
            **blank,
            "case": make_case(recording, smooth_state(recording.signals), BELIEVED),
            "best": estimate_constants(1.4 - drag),
            "with_laws": estimate_constants(drag),
        }
    )


@pytest.mark.parametrize("drag", [0.5, 0.9])
def test_with_measured_laws_a_constant_is_that_of_the_fit_with_laws(drag: float) -> None:
    warnings = describe_contradictions(make_findings(RECORDING, drag))
    assert [f"the recording shows {drag:.3g} " in warning for warning in warnings] == (
        [True] if drag != INTECO.rig.cart_viscous_n_s_m else []
    )


def test_commands_that_stood_late_are_a_warning() -> None:
    note = "every command stood 1 sample (10 ms) after it began to act"
    late = replace(RECORDING, findings=(QualityFinding(LATE, 1, (), note),))
    drag = INTECO.rig.cart_viscous_n_s_m
    assert drag is not None
    assert describe_contradictions(make_findings(late, drag)) == (f"{note.capitalize()}.",)

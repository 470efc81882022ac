"""What is believed of a constant is compared with the value that the verdict tells."""

from collections import namedtuple
from dataclasses import replace
from typing import Any

import pytest
from support.made_recordings import INTECO

from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.contradictions import describe_contradictions
from pendulum_sysid.telling.outcome import Findings

BELIEVED = replace(INTECO, spreads={"cart_viscous_n_s_m": 0.01})
Fit = namedtuple("Fit", "estimates")


def estimate_constants(drag: float) -> Fit:
    """Return a fit whose viscous friction of the cart is sure, in N s/m."""
    values = {c.name: Estimate(c.believed, 0.0, 1e9) for c in list_rig_parameters(BELIEVED)}
    return Fit({**values, "cart_viscous_n_s_m": Estimate(drag, drag - 0.01, drag + 0.01)})


@pytest.mark.parametrize("drag", [0.5, 0.9])
def test_with_measured_laws_a_constant_is_that_of_the_fit_with_laws(drag: float) -> None:
    blank: dict[str, Any] = dict.fromkeys(Findings.__dataclass_fields__)
    findings = Findings(
        **{
            **blank,
            "case": namedtuple("Case", "twin")(BELIEVED),
            "best": estimate_constants(1.4 - drag),
            "with_laws": estimate_constants(drag),
        }
    )
    warnings = describe_contradictions(findings)
    assert [f"the recording shows {drag:.3g} " in warning for warning in warnings] == (
        [True] if drag != INTECO.rig.cart_viscous_n_s_m else []
    )

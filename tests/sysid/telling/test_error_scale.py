"""The picture of an error on the rig: a rule of a millimetre, and notes that leave it readable."""

import re
from dataclasses import replace

import pytest
from support.drawn_verdicts import make_named

from pendulum_sysid.telling.error_scale import draw_meaning
from pendulum_sysid.verdict.scores import BeforeAfter


@pytest.mark.parametrize(
    ("after_mm", "rule"),
    [
        (0.01, "0.5 mm"),
        (0.4, "1 mm"),
        (1.71, "1 mm"),
        (2.0, "1 mm"),
        (2.4, "5 mm"),
        (50, "100 mm"),
    ],
)
def test_the_rule_is_a_millimetre_wherever_that_can_be_seen(after_mm: float, rule: str) -> None:
    verdict = make_named()
    assert verdict.fit is not None
    fit = replace(verdict.fit, held_out_cart_mm=BeforeAfter(50.0, after_mm))
    cart, _ = draw_meaning(replace(verdict, fit=fit))
    assert re.findall(r"<text[^>]*>([\d.]+ mm)</text>", cart) == [rule]

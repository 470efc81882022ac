"""What constants stand for is no part of a law, wherever the recording went."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.measuring.curve import list_curves
from pendulum_sysid.measuring.smoothness import make_covariance
from pendulum_sysid.prepare import prepare
from pendulum_twin.parameter_vector import make_theta

FRICTION = "cart_coulomb_friction"
PARTS = {
    "cart_dry_friction_by_velocity": ("mean", "size"),
    "cart_force_by_velocity": ("slope", "step"),
    "drive_gain_along_rail": ("mean",),
    "cart_force_by_position": (),
    "position_error_along_rail": ("mean",),
}


@pytest.mark.parametrize("name", PARTS)
def test_a_law_has_no_share_in_what_constants_and_a_named_friction_stand_for(name: str) -> None:
    case = prepare([made(INTECO, 20.0)], INTECO).case
    curves = list_curves(case, make_theta(INTECO), (FRICTION,))
    (curve,) = (c for c in curves if c.kind.name == name)
    assert tuple(sorted(curve.others)) == PARTS[name]
    draws = np.linalg.cholesky(make_covariance(curve, 2.0))
    assert np.all(np.abs(curve.gauges @ draws) < 2e-3)
    one_speed = replace(curve, seen=curve.knots[[0, -1]])  # there all parts look alike
    assert np.all(np.isfinite(make_covariance(one_speed, 2.0)))


@pytest.mark.parametrize(
    ("effects", "parts"),
    [
        ((), ()),
        (("eccentric_encoder",), ("cosine", "sine")),
        (("angle_offset", "eccentric_encoder"), ("cosine", "mean", "sine")),
    ],
)
def test_an_error_of_the_angle_leaves_effects_their_parts(effects, parts) -> None:
    case = prepare([made(INTECO, 20.0, 0.3)], INTECO).case
    curves = list_curves(case, make_theta(INTECO), effects)
    (curve,) = (c for c in curves if c.kind.name == "angle_error_over_turn")
    assert tuple(sorted(curve.parts)) == parts
    draws = np.linalg.cholesky(make_covariance(curve, 0.5))
    assert np.all(np.abs(curve.gauges @ draws) < 2e-3)

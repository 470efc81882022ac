"""The steps of a rig's encoders."""

import pytest

from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.errors import BadInputError


def test_exact_encoders_have_no_steps():
    assert Encoders() == EXACT
    assert EXACT.steps == (0.0, 0.0)


def test_steps_are_those_of_position_and_angle():
    assert Encoders(position_step_m=1e-4, angle_step_rad=0.01).steps == (1e-4, 0.01)


@pytest.mark.parametrize("key", ["position_step_m", "angle_step_rad"])
@pytest.mark.parametrize("step", [-1e-4, 1.1, float("nan")])
def test_what_is_no_step_is_refused_by_its_name(key, step):
    with pytest.raises(BadInputError, match=f"{key}: expected a number from 0 to"):
        Encoders(**{key: step})

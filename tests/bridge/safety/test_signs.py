"""The ways are those with which the emulated rig answers a push."""

import math
from itertools import product

import pytest

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.safety.signs import find_ways
from pendulum_twin.rig import Rig

SIGNS = ("input_sign_inverted", "cart_sign_inverted", "angle_sign_inverted")


@pytest.mark.parametrize("on", list(product([False, True], repeat=3)))
def test_a_push_moves_the_cart_and_the_pole_the_ways_told(
    nominal: Rig, on: tuple[bool, ...]
) -> None:
    """The guard's l sin(th) is on the cart's side of the rail where pole_way is 1."""
    effects = {name: {} for name, there in zip(SIGNS, on, strict=True) if there}
    way, pole_way = find_ways(effects)
    rig = EmulatedRig(Concealed(effects, nominal), 100.0, Encoders(0, 0.0, 0.0))
    for _ in range(5):
        rig.step(0.4)
    cart_m, pole_rad = rig.sample[:2]
    assert cart_m * way > 0
    plain = EmulatedRig(Concealed({}, nominal), 100.0, Encoders(0, 0.0, 0.0))
    for _ in range(5):
        plain.step(0.4)
    same_way = (pole_rad - math.pi) * cart_m * (plain.sample[1] - math.pi) * plain.sample[0]
    assert same_way * pole_way > 0

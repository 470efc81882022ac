"""What an effect of one recording leaves behind on the rig: a load that was put on stays on."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import THESIS as RIG
from support.twin_rigs import recording, wild_command

from pendulum_twin.free_runs import run_freely
from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

PERIOD_S, COUNT, PUT_ON = 0.01, 200, 80  # s, and samples
FORGETS = (Twin.drop_recording_effects, Twin.drop_timed_effects)


def run_twin(twin, command, start):
    first = np.zeros(1, dtype=np.int64)
    theta = make_theta(twin)[None]
    return run_freely(
        recording(command, PERIOD_S), theta, first, first, np.array([start]), len(command)
    )[0]


def carry(load_kg: float) -> Twin:
    friction = {"cart_load_friction": {"coefficient": 0.05}}
    load = {"load_put_on": {"load_kg": load_kg, "time_s": PUT_ON * PERIOD_S}}
    return Twin("thesis", RIG, {**friction, **load})


@pytest.mark.parametrize("forget", FORGETS)
@pytest.mark.parametrize("load_kg", [0.3, -0.2])
def test_the_rig_after_runs_on_as_the_loaded_rig(load_kg: float, forget) -> None:
    twin, command = carry(load_kg), wild_command(COUNT)
    whole = run_twin(twin, command, (0.0, 2.5, 0.2, 0.0))
    after = forget(twin)
    assert set(after.effects) == {"cart_load_friction"}
    rest = run_twin(after, command[PUT_ON:], tuple(whole[PUT_ON]))
    np.testing.assert_allclose(rest, whole[PUT_ON:], atol=1e-9)
    bare = run_twin(replace(after, rig=RIG), command[PUT_ON:], tuple(whole[PUT_ON]))
    assert np.abs(bare - whole[PUT_ON:]).max() > 1e-3


def test_a_live_twin_carries_the_load_from_its_start() -> None:
    live = LiveTwin(carry(0.3), PERIOD_S, 0.2)
    assert live.twin == carry(0.3).drop_recording_effects()
    live.become(carry(-0.2))
    assert live.twin == carry(-0.2).drop_recording_effects()


def test_a_cart_keeps_some_mass_and_a_pole_alone_has_no_load() -> None:
    light = carry(-100.0).drop_recording_effects().rig
    assert 0.0 < light.cart_mass_kg < 0.1 * RIG.cart_mass_kg
    keys = {k: v for k, v in RIG.to_mapping().items() if not k.startswith(("cart", "force"))}
    pole = Twin("pole", type(RIG)(**keys), carry(0.3).effects)
    assert pole.drop_recording_effects().rig == pole.rig

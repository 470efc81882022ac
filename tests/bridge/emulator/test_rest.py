"""The realistic rest: small, drawn by the seed, sealed, and really on."""

import numpy as np
import pytest

from pendulum_bridge.emulator.rest import COUNT, EVERYDAY, draw_rest
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed, open_seal, write_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.session import play_plan
from pendulum_bridge.emulator.unlisted.table import BY_NAME
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.rig import Rig


def test_a_seed_draws_the_same_rest_again_and_nothing_that_is_there_already() -> None:
    rest = draw_rest(7)
    assert rest == draw_rest(7) != draw_rest(8)
    assert len(rest) == COUNT and set(rest) <= set(EVERYDAY) <= set(BY_NAME)
    assert not set(draw_rest(7, besides=tuple(rest))) & set(rest)


def test_sizes_are_a_small_part_of_the_usual_and_shapes_are_as_usual() -> None:
    for name, values in draw_rest(3).items():
        known = BY_NAME[name]
        for key, value in values.items():
            low, high = known.sizes[key]
            if key in known.shapes:
                assert low <= value <= high
            else:
                assert 0.0 < abs(value) < 0.2 * max(abs(low), abs(high))


@pytest.mark.parametrize("seed", [1, 2])
def test_it_moves_the_rig_and_stands_in_the_seal(seed: int, nominal: Rig, tmp_path) -> None:
    plan = make_standard_plan(make_envelope(nominal), 40.0, 50.0, seed)
    runs = []
    for rest in ({}, draw_rest(seed)):
        concealed = Concealed({}, nominal, rest=rest)
        log = play_plan(EmulatedRig(concealed, 50.0, Encoders(4096), seed, timestep_s=1e-3), plan)
        runs.append(log.positions)
    apart = np.abs(runs[1] - runs[0]).max(axis=0)
    assert apart[0] > 1e-3 and apart[1] > 1e-2  # m and rad: above the encoders' steps
    write_seal(concealed, tmp_path / "seal.json")
    assert open_seal(tmp_path / "seal.json") == concealed

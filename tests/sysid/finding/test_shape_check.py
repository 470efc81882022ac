"""A right name has the shape of its law, also where smoothing has blurred what it does."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import CART_NOISE_M, INTECO, PERIOD_S, made_states, sweep

from pendulum_sysid.finding.localisation.shape_check import find_wrong_shapes, measure_remainders
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

NAME = "cart_coulomb_friction"


@pytest.mark.parametrize(("amplitude", "step_m"), [(0.08, 2e-4), (0.06, 1e-3)])
def test_friction_of_a_cart_that_hardly_moves_is_no_other_law(
    amplitude: float, step_m: float
) -> None:
    rig = replace(INTECO, effects={NAME: {"level_n": 0.6}})
    command = sweep(40.0, amplitude)
    states, every = made_states(rig, command), np.ones(len(command), dtype=bool)
    noise = np.random.default_rng(0).normal(size=(2, len(command)))
    cart = np.round((states[:, 0] + CART_NOISE_M * noise[0]) / step_m) * step_m
    signals = Signals(PERIOD_S, command, cart, states[:, 1] + 1e-3 * noise[1], every, every)
    case = prepare_case([Recording("made", "sha256:0", signals)], INTECO)
    split = split_windows(case.signals, case.state)
    alone = fit(case, split, (), make_theta(INTECO), HORIZONS[0])
    named = fit(case, split, (NAME,), make_theta(rig), HORIZONS[0])
    assert named.choose < 1.5 < alone.choose
    assert not find_wrong_shapes(case, named.theta, measure_remainders(case, named), [NAME])

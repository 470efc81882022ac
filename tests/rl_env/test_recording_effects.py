"""Effects of a recording stay with the recording: no episode of training repeats them."""

from collections.abc import Callable

import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.control.classical import make_plant
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.task import Task
from pendulum_twin.model import Twin

SLIPPED_S, SLIP_RAD = 1.0, 0.5
SLIP = {"angle_rad": SLIP_RAD, "time_s": SLIPPED_S}
SLIPPED = Twin("slipped", INTECO.rig, {"encoder_slip": SLIP})
STALE = Twin("stale", INTECO.rig, {"stale_start": {"seconds": 1.5}})
DRIFTING = Twin("drifting", INTECO.rig, {"gain_drift": {"per_s": 0.5}})
STEPS = 100  # 3 s, well beyond the slip


def run_transport(twin: Twin) -> np.ndarray:
    """Return the observed states of two episodes, (2 STEPS, 4)."""
    transport = KernelTransport(twin, 0.03)
    states = []
    for _ in range(2):
        transport.reset()
        states += [transport.exchange(0.1 * (-1) ** (k // 15)).state for k in range(STEPS)]
    return np.array(states)


def run_fleet(twin: Twin) -> np.ndarray:
    """Return the observations of two episodes, (2 STEPS, 5)."""
    fleet = Fleet([twin], 2, Task(steps=STEPS))
    commands = [0.1 * (-1) ** (k // 15) for k in range(STEPS)] * 2
    return np.array([fleet.step(np.full(2, u)).last[0].copy() for u in commands])


@pytest.mark.parametrize("run", [run_transport, run_fleet], ids=["transport", "fleet"])
@pytest.mark.parametrize("twin", [SLIPPED, STALE], ids=["slip", "stale"])
def test_no_training_episode_repeats_what_belongs_to_the_recording(
    run: Callable[[Twin], np.ndarray], twin: Twin
) -> None:
    assert np.array_equal(run(twin), run(INTECO))


@pytest.mark.parametrize("run", [run_transport, run_fleet], ids=["transport", "fleet"])
def test_a_drift_is_the_rigs_own_and_begins_anew_with_every_episode(
    run: Callable[[Twin], np.ndarray],
) -> None:
    """A rig's gain drifts from when it is switched on, in every episode as in the recording."""
    drifting, steady = run(DRIFTING), run(INTECO)
    assert np.abs(drifting - steady)[STEPS - 1].max() > 0.01
    np.testing.assert_allclose(drifting[STEPS:], drifting[:STEPS], atol=1e-6)


def test_the_classical_controller_does_not_expect_the_slip_either() -> None:
    assert make_plant(SLIPPED, Task()).twin.effects == {}

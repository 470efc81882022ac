"""The swing-down ends at rest in the middle whatever is concealed, and says when it could not."""

import math

import numpy as np
import pytest

from pendulum_bridge.emulator.concealable import TABLE, Concealable
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.swing_down import (
    Phase,
    Rest,
    SwingDown,
    advance,
    is_at_rest,
    make_tuning,
)
from pendulum_twin.rig import Rig

UPRIGHT_FAR_OUT = (-0.5, 0.05, 0.0, 0.0)
GOING_ROUND = (0.2, math.pi + 0.3, 0.0, 18.0)
HANGING = np.array([0.0, math.pi, 0.0, 0.0])


def swung_down(concealed: Concealed, start: tuple[float, ...]) -> tuple[SwingDown, np.ndarray]:
    """Return how it ended, and all true states."""
    rig, tuning = (
        EmulatedRig(concealed, start=start, timestep_s=1e-3),
        make_tuning(concealed.rig, concealed.effects),
    )
    stand, states = SwingDown(), []
    while stand.phase is Phase.RUNNING:
        states.append(rig.truth)
        stand, command = advance(stand, rig.truth, tuning, rig.period_s)
        rig.step(command)
    return stand, np.array(states)


@pytest.mark.parametrize(
    "effect", [effect for effect in TABLE if effect.rests], ids=lambda effect: effect.name
)
def test_it_ends_at_rest_whatever_is_concealed(effect: Concealable, nominal: Rig) -> None:
    largest = {name: high for name, (_, high) in effect.sizes.items()}
    stand, states = swung_down(Concealed({effect.name: largest}, nominal), UPRIGHT_FAR_OUT)
    assert stand.phase is Phase.AT_REST
    last = states[-Rest().samples :]
    assert np.all(np.abs(last[:, 0]) < 0.01) and np.all(np.abs(last[:, 2]) < 0.02)
    assert np.all(np.abs(np.sin(last[:, 1])) < 0.05) and np.all(np.cos(last[:, 1]) < 0)
    assert np.max(np.abs(states[:, 0])) < 0.7  # away from the rail's ends


def test_a_pole_that_goes_round_is_brought_to_rest(nominal: Rig) -> None:
    stand, states = swung_down(Concealed({}, nominal), GOING_ROUND)
    assert stand.phase is Phase.AT_REST and stand.elapsed_s < 10
    assert states[-1, 1] == pytest.approx(
        3 * math.pi, abs=0.02
    )  # one turn on: angles are not wrapped


def test_at_rest_already_takes_only_the_samples_in_a_row(nominal: Rig) -> None:
    stand, states = swung_down(Concealed({}, nominal), tuple(HANGING))
    assert stand.phase is Phase.AT_REST
    assert len(states) == Rest().samples


def test_passing_through_the_middle_is_not_rest(nominal: Rig) -> None:
    tuning = make_tuning(nominal, {})
    assert is_at_rest(HANGING, tuning)
    for k, much in enumerate((0.02, 0.1, 0.1, 0.3)):
        away = HANGING.copy()
        away[k] += much
        assert not is_at_rest(away, tuning)
    almost = SwingDown(still=Rest().samples - 1)
    moving, _ = advance(almost, np.array([0.0, math.pi, 0.0, 5.0]), tuning, 0.01)
    assert (moving.phase, moving.still) == (Phase.RUNNING, 0)


def test_what_does_not_come_to_rest_is_given_up_with_no_command(nominal: Rig) -> None:
    stuck, stand, command = np.array([0.4, math.pi, 0.0, 0.0]), SwingDown(), 1.0
    steps = 0
    while stand.phase is Phase.RUNNING:
        stand, command = advance(stand, stuck, make_tuning(nominal, {}), 0.01, Rest(limit_s=0.5))
        steps += 1
    assert (stand.phase, command) == (Phase.GAVE_UP, 0.0)
    assert steps == pytest.approx(51, abs=1)
    assert advance(stand, HANGING, make_tuning(nominal, {}), 0.01) == (stand, 0.0)  # over is over


def test_commands_stay_within_the_limit(nominal: Rig) -> None:
    _, command = advance(
        SwingDown(), np.array([0.9, 0.5, -9.0, 30.0]), make_tuning(nominal, {}), 0.01
    )
    assert abs(command) == nominal.pwm_limit

"""The controller in closed loop keeps the cart on the rail, swings up, balances, and hangs."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.session import record_rig
from pendulum_bridge.studies.trial.controller import (
    PLACED_POLYNOMIAL,
    Controller,
    Mode,
    Stand,
    compute_control,
    make_tuning,
)
from pendulum_bridge.studies.trial.mix import USUAL_SHARES
from pendulum_bridge.studies.trial.trial import draw_trial
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig


def record_controller(
    concealed: Concealed,
    nominal: Rig,
    seed: int = 1,
    seconds: float = 60.0,
    relay: bool = False,
):
    """Return log, the cart's largest true distance from the middle, and samples of each mode."""
    rig = EmulatedRig(concealed, seed=seed, timestep_s=2e-3)
    controller = Controller(make_tuning(nominal, seconds, rig.period_s, seed, relay))
    far, modes = [0.0], Counter()

    def control(sample: np.ndarray) -> float:
        far.append(abs(float(rig.truth[0])))
        command = controller(sample)
        modes[controller.stand.mode] += 1
        return command

    return record_rig(rig, control, round(seconds * 100)), max(far), modes


def test_it_does_all_of_its_work_on_the_rig_that_it_knows(nominal: Rig) -> None:
    log, far, modes = record_controller(Concealed({}, nominal), nominal)
    assert far < 0.6 * nominal.rail_half_length_m
    assert modes[Mode.BALANCE] > 1000 and modes[Mode.FOLLOW] > 2000 and modes[Mode.SWING] > 100
    assert np.max(np.abs(log.commands)) <= 0.5


def test_a_relay_swings_up_and_catches_the_pole(nominal: Rig) -> None:
    log, far, modes = record_controller(Concealed({}, nominal), nominal, relay=True)
    assert far < 0.6 * nominal.rail_half_length_m
    assert modes[Mode.BALANCE] > 100 and modes[Mode.FOLLOW] > 2000 and modes[Mode.SWING] > 100
    upright = np.cos(np.array(log.positions)[:, 1]) > 0.95
    assert np.mean(upright) > 0.05


@pytest.mark.long
@pytest.mark.parametrize("relay", [False, True])
@pytest.mark.parametrize("number", range(0, 20, 2))
def test_the_cart_stays_on_the_rail_whatever_is_concealed(
    number: int, relay: bool, nominal: Rig
) -> None:
    trial = draw_trial(
        number,
        11,
        {kind: share for kind, share in USUAL_SHARES.items() if kind != "nothing"},
        nominal,
    )
    log, far, _ = record_controller(trial.concealed, nominal, trial.seed, relay=relay)
    assert far < 0.8 * nominal.rail_half_length_m
    assert np.std(log.commands) > 0.03


@pytest.mark.parametrize(
    "effect", ["input_sign_inverted", "cart_sign_inverted", "angle_sign_inverted"]
)
def test_wrong_signs_are_seen_from_the_push(effect: str, nominal: Rig) -> None:
    _, far, modes = record_controller(Concealed({effect: {}}, nominal), nominal)
    assert far < 0.6 * nominal.rail_half_length_m and modes[Mode.BALANCE] > 500


def test_the_balancing_poles_are_where_they_were_placed(nominal: Rig) -> None:
    tuning = make_tuning(nominal, 60.0, 0.01, 0)
    motion = np.array(
        [[0, 1, 0, 0], [tuning.stiffness, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]], dtype=float
    )
    closed = motion - np.outer([0, tuning.coupling, 0, 1], tuning.gains)
    assert np.poly(closed) == pytest.approx([1.0, *PLACED_POLYNOMIAL], rel=1e-6)


@pytest.mark.parametrize("mode", [Mode.FOLLOW, Mode.SWING, Mode.BALANCE])
@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(("x", "v"), [(0.5, 0.0), (-0.5, 0.0), (0.3, 1.2), (-0.3, -1.2)])
def test_a_cart_far_out_is_sent_back_before_all_else(
    mode: Mode, way: int, x: float, v: float, nominal: Rig
) -> None:
    tuning = make_tuning(nominal, 60.0, 0.01, 0)
    stand, command = compute_control(
        Stand(1200, mode, way=way), np.array([x, 0.05, v, 0.0]), tuning
    )
    assert stand.mode is Mode.RETURN and command * way * x < -0.03
    back, _ = compute_control(stand, np.array([0.1 * x, 0.05, 0.0, 0.0]), tuning)
    assert back.mode is not Mode.RETURN


def test_the_same_samples_get_the_same_commands(nominal: Rig) -> None:
    first, again = (
        record_controller(Concealed({}, nominal), nominal, seconds=8.0)[0] for _ in range(2)
    )
    assert np.array_equal(first.commands, again.commands)


def test_commands_answer_what_was_measured(nominal: Rig) -> None:
    fine, off = (record_controller(Concealed(e, nominal), nominal, seconds=8.0)[0] for e in (
        {}, {"sensor_delay": {"delay_s": 0.03}}
    ))  # fmt: skip
    assert not np.array_equal(fine.commands[200:], off.commands[200:])


def test_a_rig_without_a_rail_is_refused(nominal: Rig) -> None:
    with pytest.raises(BadInputError, match="rail_half_length_m"):
        make_tuning(replace(nominal, rail_half_length_m=None), 60.0, 0.01, 0)
    assert math.isfinite(sum(make_tuning(nominal, 60.0, 0.01, 0).gains))

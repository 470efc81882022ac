"""A controller near upright on a rig with dry friction: the cart follows its command."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.made_recordings import CART_NOISE_M, INTECO, made

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.command_answer import follows_command
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME
from pendulum_sysid.studies.proof.read_trial import read_seal
from pendulum_sysid.studies.proof.record_trial import record_trial
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals


@pytest.fixture(scope="module")
def balanced(tmp_path_factory: pytest.TempPathFactory) -> RawRecording:
    """A rig with dry friction: swing-up, balance, fall, in turns."""
    options = ["--seed", "9", "--seconds", "40", "--closed-loop"]
    options += ["--effects", "cart_coulomb_friction"]
    raw = read_bag(record_trial(tmp_path_factory.mktemp("closed"), 0, options) / "bag")
    return replace(raw, state_received_s=None)


@pytest.mark.parametrize("kind", ["duplicates", "upright"])
def test_the_cart_follows_its_own_command_alone(
    balanced: RawRecording, kind: str, tmp_path: Path
) -> None:
    raw = BY_NAME[kind].degrade(balanced, np.random.default_rng(0))
    signals = clean_recording(raw).signals
    state = smooth_state(signals)
    assert follows_command(signals, state)
    other = replace(signals, command=np.roll(signals.command, 700))
    assert not follows_command(other, state)


def test_a_dead_zone_answers_strong_commands_more_than_weak_commands(tmp_path: Path) -> None:
    """The end of a swing-up takes a second, and balancing the rest of the recording."""
    options = ["--seed", "6", "--seconds", "40", "--closed-loop", "--effects", "input_dead_zone"]
    trial = record_trial(tmp_path, 0, options)
    signals = clean_recording(read_bag(trial / "bag")).signals
    upright = np.flatnonzero(np.cos(signals.pole) > np.cos(0.2))
    fallen = upright[0] + np.flatnonzero(np.cos(signals.pole[upright[0] :]) < np.cos(0.35))
    once = signals.cut([(int(upright[0]) - 120, int(fallen[fallen > upright[0] + 300][0]))])
    assert follows_command(once, smooth_state(once))
    other = replace(once, command=np.roll(once.command, 400))
    assert not follows_command(other, smooth_state(other))


@pytest.mark.long
def test_a_controller_that_pulls_against_a_cable_moves_the_cart(tmp_path: Path) -> None:
    options = ["--seed", "26006", "--seconds", "60", "--closed-loop", "--pole-counts", "1024"]
    trial = record_trial(tmp_path, 37, options)
    (hidden,) = read_seal(trial / "seal.json").unlisted
    assert hidden.name == "dragged_cable"
    signals = clean_recording(read_bag(trial / "bag")).signals
    state = smooth_state(signals)
    assert follows_command(signals, state)
    other = replace(signals, command=np.roll(signals.command, 700))
    assert not follows_command(other, state)


def test_a_cart_that_the_pole_alone_moves_needs_no_command() -> None:
    n = 1500
    still = Signals(
        0.01, np.zeros(n), np.zeros(n), np.zeros(n), np.ones(n, bool), np.ones(n, bool)
    )
    zero = np.zeros(1, dtype=np.int64)
    start = np.array([[0.0, np.pi - 1.5, 0.0, 0.0]])
    swung = run_freely(still, make_theta(INTECO)[None], zero, zero, start, n)[0]
    noise = np.random.default_rng(2).normal(size=(2, n))
    signals = replace(
        still, cart=swung[:, 0] + CART_NOISE_M * noise[0], pole=swung[:, 1] + 1e-3 * noise[1]
    )
    assert follows_command(signals, smooth_state(signals))


def test_a_cart_that_moves_without_any_command_or_push_is_refused() -> None:
    driven = made(INTECO, 15.0, 0.3)
    erased = replace(driven.signals, command=np.zeros(len(driven.signals)))
    assert not follows_command(erased, smooth_state(erased))

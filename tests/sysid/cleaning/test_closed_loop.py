"""A controller near upright on a rig with dry friction: the cart follows its command."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.command_answer import follows_command
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME
from pendulum_sysid.studies.proof.record_trial import record_trial


@pytest.fixture(scope="module")
def balanced(tmp_path_factory: pytest.TempPathFactory) -> RawRecording:
    """A rig with dry friction: swing-up, balance, fall, in turns."""
    options = ["--seed", "9", "--seconds", "40", "--closed-loop"]
    options += ["--effects", "cart_coulomb_friction"]
    return read_bag(record_trial(tmp_path_factory.mktemp("closed"), 0, options) / "bag")


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


def test_a_cart_that_nothing_commands_is_no_refusal() -> None:
    """The pole's swing moves a cart whose drive is off; there is no command to be answered."""
    swung = made(INTECO, 10.0, 0.3)
    signals = replace(swung.signals, command=np.zeros(len(swung.signals)))
    assert follows_command(signals, smooth_state(signals))

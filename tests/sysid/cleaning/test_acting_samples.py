"""From which sample on a command acted."""

import numpy as np

from pendulum_sysid.cleaning.acting_samples import settle_commands
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_twin.signals import Signals

PERIOD_S, COUNT = 1e-4, 20_000  # 10 kHz, of which every tenth sample is kept


def refuse() -> SmoothState:
    raise AssertionError("no command is in doubt where samples are left out later")


def test_samples_that_will_be_left_out_ask_for_no_command() -> None:
    clock = PERIOD_S * np.arange(COUNT)
    every = np.ones(COUNT, dtype=bool)
    signals = Signals(PERIOD_S, np.zeros(COUNT), 0.1 * np.sin(clock), None, every, every)
    stamps = clock[::100] + np.random.default_rng(1).uniform(0.0, 5e-3, COUNT // 100)
    commands = np.sin(stamps)
    settled = settle_commands(signals, refuse, np.sort(stamps), commands)
    assert set(settled.command) <= {0.0, *commands}

"""From which sample on a command acted."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.paths import ROOT

from pendulum_sysid.cleaning.acting_samples import settle_commands
from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.command_arrivals import find_clock_bounds, list_arrivals
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.reading.bag import read_bag
from pendulum_twin.model import load_twin
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.signals import Signals

PERIOD_S, COUNT = 1e-4, 20_000  # 10 kHz, of which every tenth sample is kept


def refuse() -> SmoothState:
    raise AssertionError("no command is in doubt where samples are left out later")


def test_samples_that_will_be_left_out_ask_for_no_command() -> None:
    clock = PERIOD_S * np.arange(COUNT)
    every = np.ones(COUNT, dtype=bool)
    signals = Signals(PERIOD_S, np.zeros(COUNT), 0.1 * np.sin(clock), None, every, every)
    stamps = clock[::100] + np.random.default_rng(1).uniform(0.0, 5e-3, COUNT // 100)
    arrivals = list_arrivals(signals, np.sort(stamps), np.sin(stamps))
    bounds = find_clock_bounds(False, PERIOD_S)
    settled, doubt = settle_commands(signals, refuse, arrivals, bounds)
    assert doubt is None and settled is signals


def test_a_cart_that_friction_holds_moves_no_command(tmp_path: Path) -> None:
    """Every command comes before the middle; where the cart sticks it answers none of them."""
    pytest.importorskip("mujoco")
    from pendulum_bridge.emulator.rig import EmulatedRig
    from pendulum_bridge.emulator.seal import Concealed
    from pendulum_bridge.emulator.session import play_plan
    from pendulum_bridge.recording.bag_writer import write_bag

    rig = load_twin(ROOT / "config" / "inteco.yaml").rig
    concealed = Concealed({"cart_coulomb_friction": {"level_n": 2.2}}, rig)
    plan = make_standard_plan(make_envelope(rig), 40.0, 100.0, 1)
    write_bag(play_plan(EmulatedRig(concealed), plan), tmp_path / "bag")
    raw = read_bag(tmp_path / "bag")
    late_s = np.random.default_rng(0).uniform(0.002, 0.0049, len(raw.command))
    found = clean_recording(replace(raw, command_stamp_s=raw.command_stamp_s + late_s))
    assert np.array_equal(found.signals.command, raw.command[: len(found.signals)])

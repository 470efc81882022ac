"""A rig whose commands act when they come is told from a rig that takes them at its samples."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.clock import hold_commands
from pendulum_sysid.finding.commands_at_once import take_commands_at_once
from pendulum_sysid.finding.settled_search import settle_commands
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.signals import Signals

COUNT, PARTS = 4000, 20
DUE = PERIOD_S * np.arange(COUNT)
PLAN = make_standard_plan(make_envelope(INTECO.rig), PERIOD_S * COUNT, 100.0, 3)
PLANNED = PLAN.commands[:COUNT]
DRAGGED = replace(INTECO, effects={"cart_coulomb_friction": {"level_n": 0.5}})


def record(at_once: bool) -> RawRecording:
    """Return a recording whose samples are answered after 2.7 ms, unevenly by 0.8 ms."""
    random = np.random.default_rng(5)
    sent_s = np.maximum.accumulate(DUE + random.gamma(11.0, 2.7e-3 / 11.0, COUNT))
    part_s = PERIOD_S / PARTS
    begins = part_s * np.arange(COUNT * PARTS)
    fine = hold_commands(begins, part_s, sent_s, PLANNED, nearest=False)
    states = move(fine if at_once else np.repeat(PLANNED, PARTS), part_s)[::PARTS]
    cart = states[:, 0] + random.normal(0.0, 2e-5, COUNT)
    pole = states[:, 1] + random.normal(0.0, 5e-4, COUNT)
    return RawRecording("made", "sha256:1", DUE, cart, pole, sent_s, PLANNED)


def move(command: Floats, period_s: float) -> Floats:
    """Return the states (n, 4) of the dragged rig."""
    n, zero = len(command), np.zeros(1, dtype=np.int64)
    blank = Signals(
        period_s, command, np.zeros(n), np.zeros(n), np.ones(n, bool), np.ones(n, bool)
    )
    hanging = np.array([[0.0, np.pi, 0.0, 0.0]])
    return run_freely(blank, make_theta(DRAGGED)[None], zero, zero, hanging, n)[0]


@pytest.mark.parametrize("at_once", [True, False])
def test_uneven_answers_say_whether_commands_act_at_once(at_once: bool) -> None:
    recording = clean_recording(record(at_once))
    assert recording.at_once is not None  # the cart's balance alone does not tell
    prepared = prepare([recording], DRAGGED)
    settled, _ = settle_commands(
        prepared.case, prepared.split, tuple(DRAGGED.effects), make_theta(DRAGGED)
    )
    acted = recording.at_once if at_once else PLANNED
    assert np.allclose(settled.signals.command, acted, atol=1e-6)


def test_without_a_cart_no_command_is_asked() -> None:
    """A cart that never moved is left out, and a pole alone shows no command."""
    recording = clean_recording(record(at_once=True))
    prepared = prepare([recording], DRAGGED)
    signals = replace(prepared.case.signals, cart=None)
    case = replace(prepared.case, recording=replace(prepared.case.recording, signals=signals))
    assert take_commands_at_once(case, prepared.split, (), make_theta(DRAGGED)) is case

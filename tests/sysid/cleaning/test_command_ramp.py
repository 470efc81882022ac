"""A drive with a slew limit, before any physics is known: no slip, and no motion ahead of time."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import CART_STEP_M, POLE_STEP_RAD
from support.made_recordings import INTECO, PERIOD_S, made_states

from pendulum_sysid.cleaning.causality import measure_lead
from pendulum_sysid.cleaning.command_ramp import follow_ramp
from pendulum_sysid.cleaning.slips import find_slips
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_twin.effects.drive_slew_limit import law
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.signals import Signals


def make_run(effects: dict[str, dict[str, float]], seed: int) -> Signals:
    """Return an endless rig's answer to a standard plan, with encoders."""
    command = np.array(make_standard_plan(seconds=60, seed=seed).commands)
    states = made_states(replace(INTECO, effects=effects), command)
    cart, pole = (
        step * np.rint(values / step)
        for step, values in ((CART_STEP_M, states[:, 0]), (POLE_STEP_RAD, states[:, 1]))
    )
    every = np.ones(len(command), dtype=bool)
    return Signals(PERIOD_S, command, cart, pole, every, every)


def limit_slew(command: np.ndarray, ramp_s: float) -> np.ndarray:
    memory = np.zeros(2)
    return np.array([law(u, memory, PERIOD_S, 0.0, ramp_s) for u in command.tolist()])


@pytest.mark.parametrize("ramp_s", [0.1, 0.2, 0.45])
def test_a_ramp_is_found(ramp_s: float) -> None:
    signals = make_run({"drive_slew_limit": {"ramp_s": ramp_s}}, 3)
    followed = follow_ramp(signals, smooth_state(signals))
    true = limit_slew(signals.command, ramp_s)
    assert np.std(followed - true) < 0.1 * np.std(signals.command - true)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"input_delay": {"delay_s": 0.04}},
        {"motor_lag": {"time_constant_s": 0.08}},
        {"input_saturation": {"limit": 0.2}},
        {"soft_saturation": {"limit": 0.3}},
        {"stretching_belt": {"period_s": 0.08, "damping": 0.1}},
        {"belt_backlash": {"gap_m": 0.004}},
        {"cart_coulomb_friction": {"level_n": 0.8}},
    ],
    ids=lambda effects: "+".join(effects) or "nothing",
)
def test_other_drives_have_no_ramp(effects: dict[str, dict[str, float]]) -> None:
    signals = make_run(effects, 3)
    assert follow_ramp(signals, smooth_state(signals)) is signals.command


@pytest.mark.parametrize(("ramp_s", "seed"), [(0.14, 5), (0.2, 4), (0.3, 8)])
def test_a_drive_with_a_slew_limit_does_not_slip_and_a_slip_on_it_is_found(
    ramp_s: float, seed: int
) -> None:
    """Behind a step of the command it pushes on the old way: that passed for slips."""
    signals = make_run({"drive_slew_limit": {"ramp_s": ramp_s}}, seed)
    assert find_slips(signals, smooth_state(signals)) == []
    assert signals.cart is not None
    moved = 0.05 * np.clip((signals.times_s - 20.0) / 0.1, 0.0, 1.0)
    slipped = replace(signals, cart=signals.cart + moved)
    [slip] = find_slips(slipped, smooth_state(slipped))
    assert signals.times_s[slip.first] == pytest.approx(20.0, abs=0.3)


@pytest.mark.parametrize("seed", [3, 5, 11])
def test_a_drive_with_a_slew_limit_does_not_move_before_its_command(seed: int) -> None:
    """No sum of commands is a ramp, so coming commands had a weight of 5 standard errors."""
    signals = make_run({"drive_slew_limit": {"ramp_s": 0.14}}, seed)
    lead = measure_lead(signals, smooth_state(signals))
    assert lead is not None and lead.standard_errors < 3.0

"""A rig whose command is no PWM fraction is pushed and centred as hard as one with a fraction."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.session import play_plan
from pendulum_bridge.excitation.guard import UNEQUAL_PWM, Watch, watch_sample
from pendulum_bridge.nodes.excitation_settings import ExcitationSettings, make_bounds
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.studies.trial.controller import Controller, make_tuning
from pendulum_twin.plans.excitation import Excitation, compute_command, make_standard_plan
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Push, Rest, Steps
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.rig import Rig

VOLTS, SHARE = 24.0, 48.0  # as much force as at a PWM of 0.5, and how many volts are PWM 1


@pytest.fixture(scope="module")
def in_volts(nominal: Rig) -> Rig:
    return replace(nominal, force_per_pwm_n=nominal.force_per_pwm_n / SHARE, pwm_limit=VOLTS)


def make_plan(rig: Rig, size: float) -> Excitation:
    phases = Push(), Steps(seconds=9, amplitude=0.4 * size), Rest(seconds=2, centred=True)
    return make_excitation(Plan(phases), make_envelope(rig))


@pytest.mark.parametrize("standard", [True, False], ids=["standard", "of a file"])
def test_a_plan_in_volts_moves_the_rig_alike(nominal: Rig, in_volts: Rig, standard: bool) -> None:
    logs = []
    for rig, size in ((nominal, 1.0), (in_volts, SHARE)):
        plan = make_standard_plan(make_envelope(rig)) if standard else make_plan(rig, size)
        logs.append(play_plan(EmulatedRig(Concealed({}, rig), timestep_s=2e-3), plan))
    cart = np.abs(logs[1].positions[:, 0])
    assert 0.05 < np.max(cart) < 0.95 * nominal.rail_half_length_m
    settled = slice(0, 600)  # later a pole that goes round magnifies rounding
    assert logs[1].commands[settled] / SHARE == pytest.approx(logs[0].commands[settled], abs=1e-6)
    assert logs[1].positions[settled] == pytest.approx(logs[0].positions[settled], abs=1e-6)


def test_a_plan_s_own_limit_weakens_neither_push_nor_centring(in_volts: Rig) -> None:
    """They are as strong as the rig's unit says, up to the limit."""
    room = make_envelope(in_volts)
    whole, low = (
        make_excitation(Plan((Push(), Rest(seconds=2, centred=True)), limit=limit), room)
        for limit in (None, 5.0)
    )
    assert np.max(whole.commands) == pytest.approx(0.3 * SHARE)
    assert np.max(low.commands) == 5.0
    k = len(low.commands) - 1
    for plan in (whole, low):
        assert compute_command(plan, k, 0.1, 0.0, 1) == pytest.approx(-0.012 * SHARE)


@pytest.mark.parametrize(("limit", "push"), [(0.05, 0.05), (0.3, 0.3), (0.8, 0.3), (1.0, 0.3)])
def test_a_pwm_fraction_of_another_limit_is_a_pwm_fraction(
    nominal: Rig, limit: float, push: float
) -> None:
    """It pushes as hard as any other, for 1 is the whole drive whatever the rig allows."""
    plan = make_standard_plan(make_envelope(replace(nominal, pwm_limit=limit)))
    assert np.max(plan.commands[: plan.push_ends]) == push
    centred = int(np.flatnonzero(plan.centring)[0])
    still = replace(plan, commands=np.zeros_like(plan.commands))
    assert compute_command(still, centred, 0.1, 0.0, 1) == pytest.approx(-0.012)


@pytest.mark.parametrize(("sent_v", "obeyed"), [(12.9, True), (13.1, False)])
def test_small_differences_of_a_rig_in_volts_do_not_count(
    in_volts: Rig, sent_v: float, obeyed: bool
) -> None:
    bounds = make_bounds(ExcitationSettings(twin_file="rig.yaml"), make_envelope(in_volts))
    assert bounds.unequal == pytest.approx(UNEQUAL_PWM * SHARE)
    still = RigState(0.0, math.pi, 0.0, 0.0)
    watch, _ = watch_sample(still, sent_v, 0.01, Watch(requests=(0.0, 12.0)), bounds)
    assert (watch.overruled_s == 0.0) == obeyed


def test_a_closed_loop_in_volts_pushes_and_returns_alike(nominal: Rig, in_volts: Rig) -> None:
    sent = []
    for rig in (nominal, in_volts):
        controller = Controller(make_tuning(rig, 10.0, 0.01, 1))
        away = np.array([0.8, math.pi, 0.0, 0.0])
        sent.append([controller(away) for _ in range(200)])
    assert np.array(sent[1]) / SHARE == pytest.approx(np.array(sent[0]))

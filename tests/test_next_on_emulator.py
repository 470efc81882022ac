"""Diagnose, plan, play the plan on the emulated rig, diagnose both recordings: the tie is gone."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S
from support.tied_recordings import ROOM, make_gentle_sweep

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.excitation.playback import Playback, answer_sample
from pendulum_sysid.finding.search import Answer, search_effects
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.measuring.repeatability import measure_repeatability
from pendulum_sysid.planning.next_experiment import plan_next_experiment
from pendulum_sysid.planning.repeating import repeat_plan
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation, parse_plan
from pendulum_twin.plans.plan_phases import Chirp, Push, Rest, Steps
from pendulum_twin.signals import Signals

CONCEALED = Concealed(
    {"motor_lag": {"time_constant_s": 0.01}},
    replace(INTECO.rig, force_per_pwm_n=12.2, cart_viscous_n_s_m=0.46, pole_viscous_n_m_s=2.5e-4),
)


def record(plan: Excitation | Floats) -> Recording:
    """Return what the emulated rig shows of a plan played with centring, or of plain commands."""
    rig, playback, commands, states = EmulatedRig(CONCEALED), Playback(), [], []
    for k in range(len(plan.commands) if isinstance(plan, Excitation) else len(plan)):
        sample = rig.sample
        if isinstance(plan, Excitation):
            answer = answer_sample(round(k * PERIOD_S * 1e9), sample[0], sample[2], playback, plan)
            playback, command = answer.playback, answer.command or 0.0
        else:
            command = float(plan[k])
        states.append(sample)
        commands.append(command)
        rig.step(command)
    shown, every = np.array(states), np.ones(len(states), dtype=bool)
    return Recording(
        "emulated",
        f"sha256:{len(every)}",
        Signals(PERIOD_S, np.array(commands), *shown.T[:2], every, every),
    )


def search(recordings: list[Recording]) -> tuple[Case, Split, Answer]:
    case = prepare_case(recordings, INTECO)
    split = split_windows(case.signals, case.state)
    return case, split, search_effects(case, split)


@pytest.mark.long
def test_what_a_gentle_recording_ties_the_next_experiment_parts() -> None:
    first = record(make_gentle_sweep(14, 0.05))
    case, split, answer = search([first])
    tied = [tie for tie in answer.ties if not tie.by_no_motion]
    assert [{tie.effect, tie.rival} for tie in tied] == [{"motor_lag", "input_delay"}]
    coming = plan_next_experiment(case, split, answer.best, tied)
    assert coming.plan is not None
    second = record(make_excitation(parse_plan(coming.plan), ROOM))
    assert second.signals.cart is not None
    assert np.max(np.abs(second.signals.cart)) < ROOM.half_length_m
    _, _, answer = search([first, second])
    assert answer.best.effects == ("motor_lag",) and answer.ties == ()
    assert answer.named[0].inseparable_from == ()
    constant = answer.best.estimates["motor_lag.time_constant_s"].value
    assert abs(constant - 0.01) < 2e-4


def test_a_plan_that_is_played_twice_shows_that_a_lag_comes_again() -> None:
    """The second run begins where the first began, though both are pushed to the middle."""
    phases = (
        Push(),
        Chirp(seconds=8, from_hz=0.4, to_hz=2.0, amplitude=0.15),
        Steps(seconds=8, amplitude=0.2, seed=1),
        Rest(seconds=1.5, centred=True),
    )
    twice = repeat_plan(Plan(phases), INTECO.rig)
    measured = measure_repeatability(prepare_case([record(make_excitation(twice, ROOM))], INTECO))
    assert measured is not None and measured.windows > 20
    assert measured.low > 0.95

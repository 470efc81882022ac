"""The whole way round on an engine of its own: diagnose, plan, play on the emulated rig, diagnose both, tie gone."""

from dataclasses import replace

import numpy as np
from support.made_recordings import INTECO, PERIOD_S
from support.tied_recordings import ROOM, make_gentle_sweep

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.playback import Playback, answered
from pendulum_sysid.finding.identifiability import find_ties
from pendulum_sysid.finding.search import Search, missing, named, parameters_alone
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.planning.next_experiment import plan_next_experiment
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import make_excitation, parse_plan
from pendulum_twin.signals import Floats, Signals

CONCEALED = Concealed(
    {"motor_lag": {"time_constant_s": 0.01}},
    replace(INTECO.rig, force_per_pwm_n=12.2, cart_viscous_n_s_m=0.46, pole_viscous_n_m_s=2.5e-4),
)


def recorded(plan: Excitation | Floats) -> Recording:
    """Return what the emulated rig shows: of a plan played with centring, or of commands as they stand."""
    rig, playback, commands, states = EmulatedRig(CONCEALED), Playback(), [], []
    for k in range(len(plan.commands) if isinstance(plan, Excitation) else len(plan)):
        sample = rig.sample
        if isinstance(plan, Excitation):
            answer = answered(round(k * PERIOD_S * 1e9), sample[0], sample[2], playback, plan)
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


def searched(recordings: list[Recording]):
    """Return case, split, the search's fit, and for each effect named the rivals of the scores."""
    case = prepare_case(recordings, INTECO)
    search = Search(case, split_windows(case.signals, case.state), lambda line: None)
    base = parameters_alone(search)
    best = missing(search, base)
    return case, search.split, best, {one.effect: one.rivals for one in named(search, base, best)}


def test_what_a_gentle_recording_ties_the_next_experiment_parts() -> None:
    first = recorded(make_gentle_sweep(24, 0.05))
    case, parts, best, rivals = searched([first])
    tied = [one for one in find_ties(case, parts, best, rivals) if not one.by_no_motion]
    assert [{one.effect, one.rival} for one in tied] == [{"motor_lag", "input_delay"}]
    found = plan_next_experiment(case, parts, best, tied)
    assert found.plan is not None
    second = recorded(make_excitation(parse_plan(found.plan), ROOM))
    assert (
        second.signals.cart is not None
        and np.max(np.abs(second.signals.cart)) < ROOM.half_length_m
    )
    case, parts, best, rivals = searched([first, second])
    assert best.effects == ("motor_lag",) and rivals == {"motor_lag": ()}
    assert find_ties(case, parts, best, rivals) == ()
    assert (
        best.estimates["motor_lag.time_constant_s"].value == 0.01
        or abs(best.estimates["motor_lag.time_constant_s"].value - 0.01) < 2e-4
    )

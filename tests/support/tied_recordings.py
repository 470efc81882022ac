"""Recordings that leave effects tied, plans played on the hidden twin, and fits to both."""

from dataclasses import replace
from typing import Any

import numpy as np

from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.planning.planned_run import make_hanging_lanes, play_plans
from pendulum_sysid.records import Fit, Recording, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.plan_file import make_excitation, parse_plan
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.signals import Signals
from support.hidden_physics import CART_STEP_M, POLE_STEP_RAD
from support.made_recordings import INTECO, PERIOD_S, made_states

RIG = replace(INTECO.rig, cart_viscous_n_s_m=2.1, force_per_pwm_n=9.6, pole_viscous_n_m_s=2.6e-4)
ROOM = make_envelope(INTECO.rig)


def make_gentle_sweep(
    seconds: float, amplitude: float, from_hz: float = 0.3, to_hz: float = 0.6
) -> Floats:
    """Return a slow sweep that hardly moves the pole."""
    t = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    return amplitude * np.cos(2 * np.pi * (from_hz + (to_hz - from_hz) * t / seconds / 2) * t)


def make_hidden_twin(effects: dict[str, dict[str, float]]) -> Twin:
    """Return the rig as it really is."""
    return Twin("hidden", RIG, effects)


def record_twin(twin: Twin, command: Floats, seed: int = 1) -> Recording:
    """Return what encoders show of a twin that is sent a command."""
    states, n = made_states(twin, command), len(command)
    return _encoded(command, states, np.ones(n, bool), seed)


def record_plan(twin: Twin, plan: dict[str, Any], seed: int = 2) -> Recording:
    """Return what encoders show of a twin on which a plan file is played."""
    excitation = make_excitation(parse_plan(plan), ROOM)
    run = play_plans(
        make_hanging_lanes(make_theta(twin)[None], 1 / excitation.rate_hz),
        [excitation],
        len(excitation.commands),
    )
    return _encoded(run.commands[0], run.states[0], np.ones(len(excitation.commands), bool), seed)


def _encoded(command: Floats, states: Floats, every: np.ndarray, seed: int) -> Recording:
    random, n = np.random.default_rng(seed), len(command)
    cart = np.round((states[:, 0] + random.normal(0, 1e-5, n)) / CART_STEP_M) * CART_STEP_M
    pole = np.round((states[:, 1] + random.normal(0, 1e-4, n)) / POLE_STEP_RAD) * POLE_STEP_RAD
    return Recording(
        f"made {seed}", f"sha256:{seed}", Signals(PERIOD_S, command, cart, pole, every, every)
    )


def fit_recordings(
    recordings: list[Recording], twin: Twin, effects: tuple[str, ...] | None = None
) -> tuple[Case, Split, Fit]:
    """Return recordings as a case of the nominal twin, its windows, and a fit from the truth.

    effects: what is fitted; None for the effects of the true twin.
    """
    recording = join_recordings(recordings)  # whole: no start is taken for another run's
    case = make_case(recording, smooth_state(recording.signals), INTECO)
    split = split_windows(case.signals, case.state)
    return (
        case,
        split,
        fit(case, split, tuple(twin.effects) if effects is None else effects, make_theta(twin), 1),
    )

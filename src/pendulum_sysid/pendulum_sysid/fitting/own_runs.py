"""Recordings that a twin makes of itself: what a perfect model leaves is what these leave.

The runs follow a recording as near as the twin can: near upright, a run from the smoothed start
falls away from a pole that a controller holds. They get the sensors' noise and are smoothed as
recordings are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.signals import Signals

SEED = 0  # of the noise


def record_own_runs(case: Case, theta: Floats, windows: Windows) -> Case | None:
    """Return a case whose recording a twin with this theta (SIZE,) has made, a stretch a window.

    windows: of the case's recording, which the runs follow.

    None where the twin's own runs leave all bounds, or no window is given.
    """
    if not len(windows):
        return None
    pieces, runs = run_own(case, theta, windows)
    if not np.all(np.isfinite(runs)):
        return None
    return record_runs(case, pieces, runs, np.random.default_rng(SEED))


def run_own(case: Case, theta: Floats, windows: Windows) -> tuple[Signals, Floats]:
    """Return the windows as stretches of their own, and runs (windows, n, 4) that follow them.

    theta: (SIZE,) of the twin that runs, without noise, from start states that are fitted.
    """
    begins = windows.begin.tolist()
    pieces = case.signals.cut([(first, first + windows.samples) for first in begins])
    motion = replace(windows, begin=np.array(pieces.stretch_begins))
    problem = replace(case.problem(motion), signals=pieces)
    starts = refine_start_states(problem, theta).start_states
    set_of = np.zeros(len(windows), dtype=np.int64)
    return pieces, run_freely(pieces, theta[None], set_of, motion.begin, starts, windows.samples)


def record_runs(case: Case, pieces: Signals, runs: Floats, random: np.random.Generator) -> Case:
    """Return a case of the same rig whose recording is made of noisy runs.

    pieces: of the case's recording, a stretch for each run.
    runs: (windows, n, 4) without noise.
    random: draws the noise.
    """
    positions = []
    for k, (there, noise) in enumerate(
        ((pieces.cart, case.state.noise.cart_m), (pieces.pole, case.state.noise.pole_rad))
    ):
        noiseless = runs[..., k].reshape(-1)
        positions.append(
            None
            if there is None or noise is None
            else noiseless + random.normal(0.0, noise, len(noiseless))
        )
    every = np.ones(len(pieces), dtype=bool)
    perfect = replace(
        pieces, cart=positions[0], pole=positions[1], cart_valid=every, pole_valid=every
    )
    recording = replace(case.recording, signals=perfect, doubt=None, at_once=None)
    return make_case(recording, smooth_state(perfect), case.twin)

"""The score that a perfect model would reach on a recording: the twin judged on data that the twin itself made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.case import Case, case_of
from pendulum_sysid.window_runs import run_windows
from pendulum_sysid.windows import WINDOW_S, cut
from pendulum_twin.signals import Floats
from pendulum_twin.simulate import free_runs

CHUNK_S = 3.0  # a perfect record is made in runs so long, each from a recorded state


def noise_floor(case: Case, words: Floats, seed: int = 0) -> float:
    """Return the score of case.twin, whose words are given, on its own noisy runs, smoothed and replayed as recordings are.

    What it exceeds 1 by is what noise in the smoothed starts alone costs.
    """
    signals, random = case.signals, np.random.default_rng(seed)
    length = round(CHUNK_S / signals.period_s)
    begin = np.array([b for s in signals.stretches for b in range(s.start, s.stop - length, length)], dtype=np.int64)
    if not len(begin):
        return 1.0
    set_of = np.zeros(len(begin), dtype=np.int64)
    runs = free_runs(signals, words[None], set_of, begin, case.state.states[begin], length)
    at = (begin[:, None] + np.arange(length)).reshape(-1)
    positions = []
    for k, (there, noise) in enumerate(((signals.cart, case.state.noise.cart_m), (signals.pole, case.state.noise.pole_rad))):
        made = runs[..., k].reshape(-1)
        positions.append(None if there is None or noise is None else made + random.normal(0.0, noise, len(made)))
    every = np.ones(len(at), dtype=bool)
    perfect = replace(
        signals,
        command=signals.command[at],
        cart=positions[0],
        pole=positions[1],
        cart_valid=every,
        pole_valid=every,
        starts=tuple(range(0, len(at), length)),
    )
    made_case = case_of(replace(case.recording, signals=perfect), case.twin)
    return run_windows(made_case, cut(perfect, made_case.state, WINDOW_S)).score

"""Compile the kernel's machine code before anything is timed."""

from __future__ import annotations

import numpy as np

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.free_runs import run_freely
from pendulum_twin.inverse_dynamics import evaluate_laws
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals
from pendulum_twin.stepper import HANGING

SAMPLES = 20
PERIOD_S = 0.01
ANY_RIG = Rig(0.5, 0.1, 0.02, 0.003, 9.81, 10.0, 1.0, 3e-4, 1.0, 0.5)


def compile_kernels() -> None:
    """Run every effect once, in a single run and in several together: both compile apart."""
    valid, zeros = np.ones(SAMPLES, dtype=bool), np.zeros(SAMPLES)
    signals = Signals(PERIOD_S, zeros, zeros, zeros, valid, valid)
    plain = make_theta(Twin("any", ANY_RIG))
    for effect in CATALOGUE:
        theta = plain.copy()
        theta[SLOTS[effect.name]] = [
            p.probes[0] if p.probes else p.neutral for p in effect.parameters
        ] or 1.0
        for lanes in (1, 2):
            begin = np.zeros(lanes, dtype=np.int64)
            start_states = np.tile(HANGING, (lanes, 1))
            run_freely(signals, theta[None], begin, begin, start_states, SAMPLES)
    evaluate_laws(signals, np.zeros((SAMPLES, 4)), plain)

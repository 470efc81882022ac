"""Recordings of known truth for tests of sysid, made by the kernel."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from pendulum_sysid.reading.bag import write_bag
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

ROOT = Path(__file__).parents[2]
INTECO = load_twin(ROOT / "config" / "inteco.yaml")
PERIOD_S = 0.01
CART_NOISE_M, POLE_NOISE_RAD = 5e-5, 1e-3
HANGING = np.array([0.0, np.pi, 0.0, 0.0])


def sweep(seconds: float, amplitude: float) -> Floats:
    """Return a sine sweep of the command, 0.4 Hz and rising."""
    t = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    return amplitude * np.sin(2 * np.pi * (0.4 + 0.03 * t) * t)


def made_states(twin: Twin, command: Floats) -> Floats:
    """Return the measured states (n, 4) of a run from hanging at rest, without noise."""
    n = len(command)
    blank = Signals(
        PERIOD_S, command, np.zeros(n), np.zeros(n), np.ones(n, bool), np.ones(n, bool)
    )
    zero = np.zeros(1, dtype=np.int64)
    return run_freely(blank, make_theta(twin)[None], zero, zero, HANGING[None], n)[0]


def made(
    twin: Twin, seconds: float = 20.0, amplitude: float = 0.1, seed: int = 0, noise: float = 1.0
) -> Recording:
    """Make a recording of the twin, with Gaussian noise on both sensors, times `noise`."""
    command = sweep(seconds, amplitude)
    states, n = made_states(twin, command), len(command)
    rng = np.random.default_rng(seed)
    cart = states[:, 0] + noise * rng.normal(0.0, CART_NOISE_M, n)
    pole = states[:, 1] + noise * rng.normal(0.0, POLE_NOISE_RAD, n)
    signals = Signals(PERIOD_S, command, cart, pole, np.ones(n, bool), np.ones(n, bool))
    return Recording("made", f"sha256:{seed}", signals)


def without_joint(recording: Recording, joint: str) -> Recording:
    """Return the recording with only the other joint in it."""
    return replace(recording, signals=replace(recording.signals, **{joint: None}))


def made_bag(path: Path, recording: Recording) -> Path:
    """Write the recording as a bag and return its path."""
    signals = recording.signals
    stamps = 10**9 + np.arange(len(signals)) * round(signals.period_s * 1e9)
    joints = {"cart": signals.cart, "pole": signals.pole}
    write_bag(
        path, stamps, {name: v for name, v in joints.items() if v is not None}, signals.command
    )
    return path

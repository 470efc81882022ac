"""Recordings of known truth as they were before cleaning, to be degraded by tests."""

from dataclasses import replace

import numpy as np

from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from support.made_recordings import INTECO, PERIOD_S, made


def make_raw(
    seconds: float = 20.0, twin: Twin = INTECO, seed: int = 0, noise: float = 1.0
) -> RawRecording:
    """Return a sweep of the twin, 100 Hz, with a rough command on top of it."""
    signals = made(twin, seconds, seed=seed, noise=noise).signals
    stamps = np.arange(len(signals)) * PERIOD_S
    return RawRecording(
        "made", "sha256:1", stamps, signals.cart, signals.pole, stamps, signals.command
    )


def stamp(raw: RawRecording, stamps: Floats) -> RawRecording:
    """Return the recording with other stamps of its samples."""
    return replace(raw, state_stamp_s=stamps)


def stamp_commands(raw: RawRecording, stamps: Floats) -> RawRecording:
    """Return the recording with other stamps of its commands."""
    return replace(raw, command_stamp_s=stamps)


def keep_commands(raw: RawRecording, kept: np.ndarray) -> RawRecording:
    """Return the recording with the kept commands alone."""
    return replace(raw, command_stamp_s=raw.command_stamp_s[kept], command=raw.command[kept])

"""Recordings with known contents, in memory and as bags."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.paths import SHARED_DATA

from pendulum_sysid.reading.raw import RawRecording

CART_STEP, POLE_STEP = 57.05e-6, 1.534e-3  # encoder steps of a real rig, m and rad


def make_swing(stamps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return command, cart and pole of a smooth motion, without encoder steps."""
    command = 0.4 * np.sin(2 * np.pi * (0.2 + 0.02 * stamps) * stamps)
    cart = 0.15 * np.sin(2 * np.pi * 0.7 * stamps) + 0.05 * np.sin(2 * np.pi * 1.9 * stamps)
    pole = (
        np.pi
        + 1.2 * np.sin(2 * np.pi * 0.9 * stamps + 0.3)
        + 0.3 * np.sin(2 * np.pi * 2.3 * stamps)
    )
    return command, cart, pole


def make_raw_recording(stamps: np.ndarray, **changes: object) -> RawRecording:
    """Return the motion as encoders see it, with a command at every stamp, and changes."""
    command, cart, pole = make_swing(stamps)
    contents = {
        "state_stamp_s": stamps,
        "cart": np.floor(cart / CART_STEP) * CART_STEP,
        "pole": np.floor(pole / POLE_STEP) * POLE_STEP,
        "command_stamp_s": stamps,
        "command": command,
    }
    return RawRecording(**{"name": "made", "digest": "sha256:0", **contents, **changes})


@pytest.fixture
def recording() -> Callable[..., RawRecording]:
    return make_raw_recording


@pytest.fixture
def motion() -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return make_swing


@pytest.fixture(scope="session")
def shared_data() -> Path:
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no recordings of real rigs: {SHARED_DATA} is no folder")
    return SHARED_DATA

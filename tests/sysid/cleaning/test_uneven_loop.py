"""A loop that sleeps between its turns: samples and commands at rightly stamped, uneven times."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import HANGING, INTECO

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.clock import Rate, resample
from pendulum_sysid.cleaning.encoder_steps import find_encoder_step
from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

FINE_S = 2e-4  # s; steps of the rig between the turns of the loop
TURN = 50  # steps; 10 ms
CART_NOISE_M, POLE_NOISE_RAD = 1e-5, 2e-4  # of encoders with fine steps


def record_loop(late: np.ndarray, drifts: bool) -> RawRecording:
    """Return what a loop records that is late by so many steps in each of its turns.

    late: (n,) steps.
    drifts: whether a turn begins a sleep after the last, so that its lateness adds up.
    """
    turns = np.cumsum(TURN + late) if drifts else TURN * np.arange(1, len(late) + 1) + late
    random = np.random.default_rng(4)
    command = np.repeat(0.3 * random.uniform(-1.0, 1.0, len(turns) // 8 + 1), 8)[: len(turns)]
    states = run_rig(np.repeat(command, np.diff(turns, append=turns[-1] + TURN)))
    taken = states[turns - turns[0]]
    return RawRecording(
        "loop",
        "sha256:4",
        turns * FINE_S,
        taken[:, 0] + random.normal(0.0, CART_NOISE_M, len(turns)),
        taken[:, 1] + random.normal(0.0, POLE_NOISE_RAD, len(turns)),
        turns * FINE_S,
        command,
    )


def run_rig(command: Floats) -> Floats:
    """Return the states (n, 4) of the twin in fine steps, from hanging at rest."""
    n = len(command)
    blank = Signals(FINE_S, command, np.zeros(n), np.zeros(n), np.ones(n, bool), np.ones(n, bool))
    zero = np.zeros(1, dtype=np.int64)
    return run_freely(blank, make_theta(INTECO)[None], zero, zero, HANGING[None], n)[0]


@pytest.mark.parametrize("drifts", [True, False], ids=["sleeps", "waits for a timer"])
def test_the_twin_of_an_uneven_loop_runs_at_the_noise(drifts: bool) -> None:
    late = np.random.default_rng(3).integers(0, 5, 2000) // (1 if drifts else 2)
    recording = clean_recording(record_loop(late, drifts))
    assert recording.signals.command_parts.shape[1] == 4
    assert recording.timing_spread_s == 0.0  # no command is moved
    prepared = prepare([recording], INTECO)
    misfit = fit(prepared.case, prepared.split, (), make_theta(INTECO), HORIZONS[-1]).choose
    assert misfit < 0.75  # twice as much with samples moved to instants, and commands averaged


def test_the_step_of_the_encoder_is_known_although_samples_lie_between_steps() -> None:
    raw = record_loop(np.random.default_rng(3).integers(0, 5, 1000), drifts=True)
    step = 2.0 * np.pi / 1000
    recording = clean_recording(replace(raw, pole=step * np.floor(raw.positions["pole"] / step)))
    assert recording.pole_step_rad == pytest.approx(step, rel=1e-6)
    assert find_encoder_step(recording.signals.pole) == 0.0
    joined = join_recordings([clean_recording(raw), recording])
    assert joined.pole_step_rad == recording.pole_step_rad


def test_samples_that_were_taken_unevenly_are_not_moved_to_their_instants() -> None:
    """Within a twenty-fifth of a period an encoder's cart goes many steps."""
    instants = 0.01 * np.arange(100)
    stamps = instants + np.random.default_rng(1).uniform(-3e-4, 3e-4, 100)
    path = 0.1 + 2.0 * stamps - 10.0 * stamps**2 + 3.0 * stamps**3
    wanted = 0.1 + 2.0 * instants - 10.0 * instants**2 + 3.0 * instants**3
    inside = slice(3, -3)
    even, _ = resample(instants, stamps, path, Rate(0.01, 0.0))
    assert np.array_equal(even, path)
    uneven, valid = resample(instants, stamps, path, Rate(0.01, 0.0, uneven=True))
    assert valid.all()
    assert np.allclose(uneven[inside], wanted[inside], rtol=0, atol=1e-9)


def test_samples_that_came_at_once_are_joined_by_a_line() -> None:
    """A cubic would magnify the noise of two samples that share an instant."""
    instants = 0.01 * np.arange(20)
    stamps = np.sort(np.append(instants + 0.003, 0.0931))
    noise = 1e-4 * np.random.default_rng(1).normal(size=len(stamps))
    values, _ = resample(instants, stamps, noise, Rate(0.01, 0.0, uneven=True))
    assert np.abs(values).max() <= np.abs(noise).max() + 1e-9

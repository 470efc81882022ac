"""A window beside the twin: errors, derivatives, steps and spikes."""

from dataclasses import replace

import numpy as np
import pytest
from support.watched_rigs import HANGING, RATE_HZ, make_rig

from pendulum_bridge.watch.noise import Noise, compute_scores, compute_step_scores, weigh
from pendulum_bridge.watch.reading import Reader, Reading
from pendulum_bridge.watch.signatures import find_steady_push, make_signatures
from pendulum_bridge.watch.stream import History
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals
from pendulum_twin.stepper import Stepper

SENSOR = np.array([2e-5, 5e-4])
NOISE = Noise(SENSOR, np.full(2, 0.003))
TRUTH = make_rig(3)
TWIN = Twin("exact", TRUTH.rig, TRUTH.effects)
BANK = make_signatures(TWIN, 1 / RATE_HZ)
NONE = np.zeros(len(BANK))
READER = Reader(TWIN, BANK, 1 / RATE_HZ)


def record(twin: Twin, samples: int = 200, seed: int = 0) -> History:
    """Return what a twin did under a swelling command, measured with noise."""
    random, stepper = np.random.default_rng(seed), Stepper(twin, 1 / RATE_HZ, HANGING)
    command = 0.4 * np.sin(2 * np.pi * 1.3 * np.arange(samples) / RATE_HZ)
    states = np.array([stepper.state, *(stepper.step(u) for u in command)])[:samples]
    return History(
        samples - 1, 0, command, states[:, :2] + SENSOR * random.normal(size=(samples, 2))
    )


def read(history: History) -> Reading:
    reading = READER.read(history, SENSOR)
    assert reading is not None
    return reading


def change_twin(effect: str, factor: float) -> tuple[int, Twin, float]:
    """Return a signature's number, the twin changed by factor times its worth, and the size."""
    k = next(k for k, signature in enumerate(BANK) if signature.effect == effect)
    size = factor * BANK[k].worth
    if hasattr(TWIN.rig, effect):
        return (
            k,
            replace(TWIN, rig=replace(TWIN.rig, **{effect: getattr(TWIN.rig, effect) + size})),
            size,
        )
    names = {
        "rail_tilt": "angle_rad",
        "cart_coulomb_friction": "level_n",
        "input_delay": "delay_s",
        "pole_spring": "n_m_per_rad",
    }
    values = dict(TWIN.effects.get(effect, {}))
    values[names[effect]] = values.get(names[effect], 0.0) + size
    return k, replace(TWIN, effects={**TWIN.effects, effect: values}), size


@pytest.mark.parametrize("seed", range(3))
def test_an_exact_twin_leaves_its_noise(seed: int) -> None:
    window = weigh(read(record(TWIN, seed=seed)), NOISE, NONE)
    assert 0.3 < window.misfit / len(window.off) < 1.3


@pytest.mark.parametrize(
    "effect",
    [
        "force_per_pwm_n",
        "cart_coulomb_friction",
        "rail_tilt",
        "input_delay",
        "pole_viscous_n_m_s",
        "com_distance_m",
    ],
)
def test_a_change_alone_is_measured_in_its_unit(effect: str) -> None:
    k, twin, size = change_twin(effect, 2.0)
    reading = read(record(twin))
    score, information = compute_scores(reading, weigh(reading, NOISE, NONE))
    estimate, deviation = score[k] / information[k, k], information[k, k] ** -0.5
    assert (
        estimate == pytest.approx(size, abs=4 * deviation + 0.2 * size)
        and abs(estimate) > 2 * deviation
    )


@pytest.mark.parametrize("joint", [0, 1])
def test_a_step_is_found_at_its_sample(joint: int) -> None:
    history, size, at = record(TWIN), (0.003, 0.04)[joint], 20
    first = len(history.command) - 1 - READER.samples
    positions = history.positions.copy()
    positions[first + at :, joint] += size
    reading = read(replace(history, positions=positions))
    score, information = compute_step_scores(
        reading, weigh(reading, NOISE, NONE), joint, READER.samples
    )
    gain = score**2 / np.maximum(information, 1e-300)
    assert int(np.argmax(gain[1:-1])) + 1 == at
    assert score[at] / information[at] == pytest.approx(size, rel=0.1)
    assert gain[at] > 100


def test_a_wrong_sample_is_left_out() -> None:
    history = record(TWIN)
    positions = history.positions.copy()
    positions[-20] += [0.05, 1.0]
    reading = read(replace(history, positions=positions))
    assert READER.samples + 1 - 20 not in reading.at and len(reading.off) == 2 * READER.samples
    window = weigh(reading, NOISE, NONE)
    assert window.misfit / len(window.off) < 3.0


def test_whole_turns_do_not_matter() -> None:
    history = record(TWIN)
    turned = replace(history, positions=np.add(history.positions, [0.0, 6 * np.pi]))
    assert read(turned).off == pytest.approx(read(history).off, abs=1e-9)
    assert read(turned).by_signature == pytest.approx(
        read(history).by_signature, abs=1e-6
    )  # no spring is wound up


def test_the_rails_end_and_missing_samples_are_not_read() -> None:
    history = record(TWIN)
    at_end, lost = history.positions.copy(), history.positions.copy()
    at_end[-10, 0] = 0.89
    lost[-30:] = np.nan
    assert READER.read(replace(history, positions=at_end), SENSOR) is None
    assert READER.read(replace(history, positions=lost), SENSOR) is None
    assert (
        READER.read(History(59, 0, history.command[:60], history.positions[:60]), SENSOR) is None
    )


def test_near_upright_a_window_counts_for_little() -> None:
    """There a run magnifies every small error, and the pushes that stand for them as well."""
    hanging, upright = (
        Stepper(TWIN, 1 / RATE_HZ, (0.0, angle, 0.0, 0.1)) for angle in (np.pi - 0.05, 0.05)
    )  # fmt: skip
    known = []
    for stepper in (hanging, upright):
        states = np.array([stepper.step(0.1 * np.sin(0.1 * k)) for k in range(100)])
        reading = read(History(99, 0, 0.1 * np.sin(0.1 * (np.arange(100) + 1)), states[:, :2]))
        window = weigh(reading, NOISE, NONE)
        through = window.weigh(reading.by_push[:, reading.push_joint == 1])
        known.append(float(np.max(np.abs(reading.by_push))))
        assert np.all(np.isfinite(through))
    assert known[1] > known[0]


def test_a_steady_push_accelerates_the_cart_by_its_size() -> None:
    """The effect's own law says how large the push is."""
    bare = Rig(cart_mass_kg=0.7, force_per_pwm_n=5.0, cart_viscous_n_s_m=0.0)
    theta = make_theta(Twin("bare", bare))
    place, size = find_steady_push(theta)
    theta[place] += 2.0 * size
    count, first = 101, np.zeros(1, dtype=np.int64)
    nothing, valid = np.zeros(count), np.ones(count, dtype=bool)
    signals = Signals(0.01, nothing, nothing, nothing, valid, valid)
    states = run_freely(signals, theta[None], first, first, np.array([HANGING]), count)[0]
    assert states[-1, 2] == pytest.approx(2.0, rel=1e-6)  # m/s after a second

"""Samples and commands of a computer that is too busy for both: who acted when is known here."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made_states

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.even_clock import EvenClock
from pendulum_sysid.cleaning.received_clock import place_clock
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.waveforms import make_envelope

PERIOD_S, COUNT = 0.01, 4000
DUE = PERIOD_S * np.arange(COUNT)
PLANNED = make_standard_plan(make_envelope(INTECO.rig), PERIOD_S * COUNT, 100.0, 1).commands
EFFECTS = {
    "nothing": {},
    "slack": {"belt_backlash": {"gap_m": 0.006}},
    "eccentric": {"eccentric_encoder": {"sine_rad": -0.07, "cosine_rad": 0.1}},
}


def record(effects: dict[str, dict[str, float]], seed: int) -> tuple[RawRecording, Floats]:
    """Return a recording of a busy computer, and the command that acted from each sample on.

    The driver sends up to three commands a sample, at any time, and publishes some of them late.
    It stamps samples unevenly and late, more and more so, and receives most of them late.
    """
    random = np.random.default_rng(seed)
    sent_s = np.sort(random.uniform(0.0, DUE[-1], 2 * COUNT))
    sent = np.interp(sent_s, DUE, PLANNED[:COUNT])
    latest = np.searchsorted(sent_s, DUE + 0.5 * PERIOD_S) - 1
    acted = np.where(latest >= 0, sent[latest], 0.0)
    late_s = np.where(random.random(len(sent)) < 0.02, random.exponential(3e-3, len(sent)), 0.0)
    published_s = np.maximum.accumulate(sent_s + 3e-5 + late_s)
    received_s = DUE + 1.5e-4 + random.exponential(3e-3, COUNT)
    stamps = DUE + 1e-3 * DUE / DUE[-1] + random.normal(0.0, 1.5e-3, COUNT)
    cart, pole, _, _ = made_states(replace(INTECO, effects=effects), acted).T
    cart = np.round(cart + random.normal(0.0, 2e-5, COUNT), 5)
    raw = RawRecording(
        "made", "sha256:1", np.sort(stamps - stamps[0]), cart, pole,
        published_s - stamps[0], sent, state_received_s=received_s - stamps[0],
    )  # fmt: skip
    return raw, acted


@pytest.mark.parametrize("effect", EFFECTS)
@pytest.mark.parametrize("seed", [1, 2])
def test_commands_act_from_their_samples_whatever_the_rig_conceals(effect: str, seed: int) -> None:
    raw, acted = record(EFFECTS[effect], seed)
    signals = clean_recording(raw).signals
    assert signals.period_s == pytest.approx(PERIOD_S, rel=1e-6)
    first = round((signals.clock_s[0] - raw.state_stamp_s[0]) / PERIOD_S)
    off = np.abs(signals.command - acted[first : first + len(signals)])
    untouched = clean_recording(replace(raw, state_received_s=None)).signals.command
    off_before = np.abs(untouched - acted[: len(untouched)])
    print(f"{np.sum(off > 1e-9)} wrong, together by {np.sum(off):.3f} ({np.sum(off_before):.3f})")
    assert np.sum(off) < 0.7 and np.sum(off) < np.sum(off_before)


@pytest.mark.parametrize("stood_still_s", [0.0, 0.02])
@pytest.mark.parametrize("effect", EFFECTS)
def test_the_clock_of_a_quiet_computer_is_known(effect: str, stood_still_s: float) -> None:
    """Answers come a quarter of a period after their samples, and every sample at once."""
    random = np.random.default_rng(7)
    taken_s = DUE.copy()
    if stood_still_s:  # a burst follows
        taken_s[1500:1510] = np.maximum(
            DUE[1500] + stood_still_s + 2e-3 * np.arange(10), DUE[1500:1510]
        )
    received_s = taken_s + 2e-4 + random.exponential(1e-4, COUNT)
    sent_s = np.maximum.accumulate(taken_s + random.gamma(9.0, 3e-4, COUNT))
    cart, pole, _, _ = made_states(replace(INTECO, effects=EFFECTS[effect]), PLANNED[:COUNT]).T
    raw = RawRecording(
        "made", "sha256:1", taken_s, np.round(cart + random.normal(0.0, 2e-5, COUNT), 5), pole,
        sent_s, PLANNED[:COUNT], state_received_s=received_s,
    )  # fmt: skip
    found = clean_recording(raw)
    assert np.sum(np.abs(found.signals.command - PLANNED[:COUNT]) > 1e-9) <= 5
    assert len(found.signals) == COUNT


def test_samples_that_are_received_soonest_say_where_the_clock_lies() -> None:
    random = np.random.default_rng(3)
    numbers = np.arange(COUNT)
    received_s = PERIOD_S * numbers + 1e-4 + random.exponential(4e-3, COUNT)
    clock = EvenClock(1.00003 * PERIOD_S, numbers, 2e-3, np.zeros(COUNT))
    placed = place_clock(clock, received_s)
    assert placed is not None and placed[1].all()
    off_s = placed[0].times_s - PERIOD_S * numbers
    assert off_s.min() > 0.5e-4 and off_s.max() < 2e-4


def test_a_sender_that_stood_still_goes_on_by_another_clock() -> None:
    """It lost 26.34 periods: an even clock counts 26, and is off by a third of a period then."""
    random = np.random.default_rng(5)
    numbers = np.arange(COUNT)
    numbers[2500:] += 26
    numbers[3970:] += 30  # too few samples follow to tell their clock
    taken_s = PERIOD_S * numbers
    taken_s[2500:] += 0.34 * PERIOD_S
    received_s = taken_s + 1e-4 + random.exponential(4e-3, COUNT)
    received_s[3970:] += 0.5  # nor are they received in time
    placed = place_clock(EvenClock(PERIOD_S, numbers, 2e-3, np.zeros(COUNT)), received_s)
    assert placed is not None and np.array_equal(placed[1], np.arange(COUNT) < 3970)
    off_s = (placed[0].times_s - taken_s)[:3970]
    assert off_s.min() > 0.5e-4 and off_s.max() < 2.5e-4


@pytest.mark.parametrize(
    ("delay_s", "placed"), [(0.0, True), (2e-4, True), (0.03, False), (-50.0, False)]
)
def test_a_delay_that_the_stamps_know_stays(delay_s: float, placed: bool) -> None:
    """A driver may stamp with the time of exposure, or by another clock than the recorder's."""
    numbers = np.arange(COUNT)
    late_s = np.random.default_rng(4).exponential(2e-3, COUNT)
    clock = EvenClock(PERIOD_S, numbers, 0.0, np.zeros(COUNT))
    moved = place_clock(clock, PERIOD_S * numbers + delay_s + late_s)
    assert (moved is not None) == placed

"""Command k belongs to sample k: whatever becomes of the samples in between."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.session import play_plan
from pendulum_bridge.excitation.playback import (
    Playback,
    answer_sample,
    is_over,
    is_rate_fitting,
    measure_rate,
)
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Chirp, Push, Rest, Samples, Steps
from pendulum_twin.plans.waveforms import Envelope
from pendulum_twin.rig import Rig

PERIOD_NS = 10_000_000
FIRST_NS = 1_700_000_000_123_456_789
COUNT = 3000


def numbered(count: int = COUNT) -> Excitation:
    """Return a plan whose every command says its number."""
    return make_excitation(
        Plan((Samples(commands=tuple(np.arange(1, count + 1) * 1e-4), centred=False),)), Envelope()
    )


PLAN = numbered()


def replies(stamps: list[float], plan: Excitation = PLAN) -> tuple[list[float | None], Playback]:
    """Return each sample's command as its number in the plan, and the playback at the end."""
    playback, sent = Playback(), []
    for stamp in stamps:
        answer = answer_sample(FIRST_NS + round(stamp * PERIOD_NS), 0.0, 0.0, playback, plan)
        playback = answer.playback
        sent.append(None if answer.command is None else round(answer.command * 1e4) - 1)
    return sent, playback


def test_each_sample_gets_its_command_and_the_end_is_0() -> None:
    sent, playback = replies(list(range(COUNT + 2)))
    assert sent == [*range(COUNT), -1, -1]
    assert is_over(playback, PLAN) and playback.lost == 0


@settings(deadline=None, max_examples=50)
@given(kept=st.lists(st.booleans(), min_size=5, max_size=200))
def test_a_lost_sample_takes_its_command_along(kept: list[bool]) -> None:
    stamps = [0, *(k + 1 for k, on in enumerate(kept) if on)]
    sent, playback = replies(stamps)
    assert sent == stamps
    assert playback.lost == stamps[-1] - (len(stamps) - 1)


@settings(deadline=None, max_examples=50)
@given(
    seed=st.integers(0, 10**6),
    jitter=st.floats(0, 0.2),
    drift=st.floats(-0.002, 0.002),
    lost=st.floats(0, 0.2),
)
def test_uneven_stamps_and_another_clock_shift_nothing(
    seed: int, jitter: float, drift: float, lost: float
) -> None:
    """Stamps off by up to 0.2 periods; the rig's clock may gain or lose three samples."""
    random = np.random.default_rng(seed)
    samples = [k for k in range(1500) if k == 0 or random.random() >= lost]
    stamps = [k * (1 + drift) + random.uniform(-jitter, jitter) for k in samples]
    assert replies(stamps)[0] == samples


def test_a_late_sample_does_not_move_those_after_it() -> None:
    sent, _ = replies([0, 1, 2, 3.9, 4, 5, 6])
    assert sent[:3] == [0, 1, 2] and sent[4:] == [4, 5, 6]


def test_samples_that_are_not_newer_get_no_answer() -> None:
    sent, playback = replies([5, 6, 3, 6, 7])
    assert sent == [0, 1, None, None, 2]
    assert playback.old == 2 and playback.lost == 0


@pytest.fixture(scope="module")
def centred() -> Excitation:
    chirp = Chirp(seconds=3, from_hz=1, to_hz=3, amplitude=0.3)
    return make_excitation(
        Plan((Push(), chirp, Steps(seconds=3, amplitude=0.4), Rest(seconds=1, centred=True))),
        Envelope(),
    )


@pytest.mark.parametrize("effects", [{}, {"cart_sign_inverted": {}}])
def test_answers_are_those_of_a_rig_in_process(
    effects: dict, centred: Excitation, nominal: Rig
) -> None:
    """Sample by sample, and in one go: the same bits, centring and the cart's way included."""
    log = play_plan(EmulatedRig(Concealed(effects, nominal), timestep_s=1e-3), centred)
    playback, sent = Playback(), []
    for k, stamp in enumerate(log.stamps_ns.tolist()):
        answer = answer_sample(stamp, log.positions[k, 0], log.velocities[k, 0], playback, centred)
        playback = answer.playback
        sent.append(answer.command)
    assert sent == log.commands.tolist()
    assert playback.way == (-1 if effects else 1)


@pytest.mark.parametrize("start_m_s", [-0.9, -0.4, 0.4, 0.9])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_cart_that_moves_already_shows_its_way_as_well(
    start_m_s: float, sign: int, centred: Excitation, nominal: Rig
) -> None:
    """As after a push that a busy computer cut short: the cart coasts farther than pushed."""
    concealed = Concealed({"input_sign_inverted": {}} if sign < 0 else {}, nominal)
    rig = EmulatedRig(concealed, timestep_s=1e-3, start=(0.0, np.pi, start_m_s, 0.0))
    playback = Playback()
    for k in range(centred.push_ends + 1):
        cart_m, _, cart_m_s, _ = rig.sample.tolist()
        answer = answer_sample(k * PERIOD_NS, cart_m, cart_m_s, playback, centred)
        playback = answer.playback
        rig.step(answer.command)
    assert playback.way == sign


def test_the_way_is_learned_also_when_the_push_s_last_sample_is_lost(centred: Excitation) -> None:
    playback = Playback()
    for k in (0, 10, 40, centred.push_ends + 2):
        playback = answer_sample(k * PERIOD_NS, -0.001 * k, 0.0, playback, centred).playback
    assert playback.way == -1


@pytest.mark.parametrize(
    ("gaps", "rate"),
    [
        ([1] * 24, 100),
        ([1] * 20 + [5] * 4, 100),  # lost ones
        ([0, 0, 3] * 8, 100),  # bursts
        ([2] * 24, 50),
        ([0.5] * 24, 200),
        ([0] * 24, 0),
    ],
)
def test_the_rate_is_seen(gaps: list[float], rate: float) -> None:
    stamps = [FIRST_NS + round(periods * PERIOD_NS) for periods in np.cumsum([0, *gaps])]
    seen = measure_rate(stamps, 100.0)
    assert seen == pytest.approx(rate)
    assert is_rate_fitting(seen, 100.0) == (rate == 100)


def test_no_sample_is_answered_twice_as_far_on(centred: Excitation) -> None:
    """Stamps so uneven that two fall into one period: the plan does not run ahead of the clock."""
    stamps = np.cumsum([0, *([1.8, 0.2] * 100)]).tolist()
    playback = Playback()
    for stamp in stamps:
        playback = answer_sample(
            round(stamp * PERIOD_NS), 0.0, 0.0, playback, replace(centred, push_ends=None)
        ).playback
        assert abs(playback.sample - stamp) < 1.01

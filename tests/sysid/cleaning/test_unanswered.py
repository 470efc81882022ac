"""A start that the cart does not answer: found where it is, and nothing else taken for it."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import CART_STEP_M, INTECO, POLE_STEP_RAD, make_command, record_hidden
from support.made_recordings import PERIOD_S, made, without_joint

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.cleaning.stale_start import leave_out_stale_start
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

pytestmark = pytest.mark.long

COULOMB = {"cart_coulomb_friction": {"level_n": 0.5}}


def dead_at_first(
    effects: dict, dead_s: float, speed_m_s: float, seed: int, seconds: float = 20.0
) -> Recording:
    """Make a recording whose drive does nothing for a while, though commands are sent."""
    _, truth = record_hidden(effects, seed, 10.0)
    n, dead = round(seconds / PERIOD_S), round(dead_s / PERIOD_S)
    sent = make_command(seed, n)
    sent[:100] = 0.3 * np.sin(2 * np.pi * 1.1 * PERIOD_S * np.arange(100) + 0.7)
    driven = np.where(np.arange(n) < dead, 0.0, sent)
    every, zero = np.ones(n, dtype=bool), np.zeros(1, dtype=np.int64)
    blank = Signals(PERIOD_S, driven, np.zeros(n), np.zeros(n), every, every)
    start = np.array([[0.05, np.pi, speed_m_s, 0.0]])
    states = run_freely(blank, make_theta(truth)[None], zero, zero, start, n)[0]
    random = np.random.default_rng(seed)
    cart, pole = (
        np.round((states[:, k] + random.normal(0, noise, n)) / step) * step
        for k, noise, step in ((0, 1e-5, CART_STEP_M), (1, 1e-4, POLE_STEP_RAD))
    )
    return Recording(
        "dead at first", f"sha256:{seed}", replace(blank, command=sent, cart=cart, pole=pole)
    )


def stale_s(recording: Recording) -> list[tuple[float, float]]:
    return [
        interval
        for one in leave_out_stale_start(recording, smooth_state(recording.signals)).findings
        if one.kind == "stale"
        for interval in one.intervals_s
    ]


@pytest.mark.parametrize("effects", [{}, COULOMB], ids=["viscous", "dry"])
@pytest.mark.parametrize(
    "speed_m_s", [0.0, 0.25, -0.25], ids=["standing", "coasting", "coasting_back"]
)
@pytest.mark.parametrize("dead_s", [0.4, 0.5, 0.6])
def test_a_dead_start_is_found(effects: dict, speed_m_s: float, dead_s: float) -> None:
    for seed in range(3):
        ((begin, end),) = stale_s(dead_at_first(effects, dead_s, speed_m_s, seed))
        assert begin == 0.0 and end == pytest.approx(dead_s, abs=0.06)


@pytest.mark.parametrize("dead_s", [0.3, 0.8])
def test_a_dead_start_is_found_though_the_command_is_weak_where_it_ends(dead_s: float) -> None:
    """Near a zero of the command silence and answer look the same for a while."""
    for seed in range(3):
        ((begin, end),) = stale_s(dead_at_first(COULOMB, dead_s, 0.0, seed))
        assert begin == 0.0 and end == pytest.approx(dead_s, abs=0.12)


def test_what_is_found_is_left_out_and_nothing_else() -> None:
    recording = dead_at_first({}, 0.5, 0.25, 1)
    cleaned = leave_out_stale_start(recording, smooth_state(recording.signals)).signals
    end = round(stale_s(recording)[0][1] / PERIOD_S)
    assert cleaned.stretch_begins == (0, end)
    assert not cleaned.cart_valid[:end].any() and not cleaned.pole_valid[:end].any()
    assert cleaned.cart_valid[end:].all() and cleaned.pole_valid[end:].all()
    assert np.array_equal(cleaned.cart, recording.signals.cart)


def test_the_verdict_is_that_without_it() -> None:
    found = diagnose(
        [dead_at_first(COULOMB, 0.6, 0.25, 1, seconds=20.0)], INTECO, lambda line: None
    ).to_dict()
    assert found["outcome"] == "named"
    (friction,) = found["missing_physics"]
    assert friction["effect"] == "cart_coulomb_friction"
    assert friction["parameters"]["level_n"]["value"] == pytest.approx(0.5, rel=0.03)
    assert [finding["kind"] for finding in found["data_quality"]] == ["stale"]


# Nothing else is taken for it

SLOW = {
    "delay": {"input_delay": {"delay_s": 0.05}},
    "lag": {"motor_lag": {"time_constant_s": 0.06}},
    "dry friction": {"cart_coulomb_friction": {"level_n": 1.5}},
    "dead zone": {"input_dead_zone": {"width": 0.12}},
    "dry friction and delay": {
        "cart_coulomb_friction": {"level_n": 1.0},
        "input_delay": {"delay_s": 0.05},
    },
    "nothing": {},
}


@pytest.mark.parametrize("effects", SLOW.values(), ids=SLOW)
def test_a_slow_answer_is_an_answer(effects: dict) -> None:
    assert [stale_s(record_hidden(effects, seed, 20.0)[0]) for seed in range(10)] == [[]] * 10


@pytest.mark.parametrize("name", SLOW)
def test_a_slow_sweep_from_rest_is_answered(name: str) -> None:
    truth = replace(INTECO, effects=SLOW[name])
    assert [stale_s(made(truth, 20.0, 0.16 + 0.03 * seed, seed)) for seed in range(10)] == [
        []
    ] * 10


def test_a_cart_that_has_answered_is_not_silent_later() -> None:
    """A pole that pushes a light cart against its command for a while leaves no start stale."""
    n, random = round(20.0 / PERIOD_S), np.random.default_rng(0)
    times = np.arange(n) * PERIOD_S
    command = 0.3 * np.sin(2 * np.pi * 1.1 * times) + 0.1 * np.sin(2 * np.pi * 2.3 * times)
    pushed = (times >= 1.0) & (times < 4.5)
    force = 10.0 * np.where(pushed, -0.5 * command, command) + random.normal(0, 0.2, n)
    speed = np.zeros(n)
    for k in range(1, n):
        speed[k] = speed[k - 1] + (force[k - 1] - 2.0 * speed[k - 1]) * PERIOD_S
    every = np.ones(n, dtype=bool)
    cart = np.cumsum(speed) * PERIOD_S
    signals = Signals(PERIOD_S, command, cart, np.full(n, np.pi), every, every)
    assert stale_s(Recording("pushed", "sha256:0", signals)) == []


def test_a_pole_alone_and_a_run_without_command_are_left_as_they_are() -> None:
    recording = dead_at_first({}, 0.5, 0.0, 1)
    silent = replace(
        recording, signals=replace(recording.signals, command=np.zeros(len(recording.signals)))
    )
    for one in (without_joint(recording, "cart"), silent):
        assert leave_out_stale_start(one, smooth_state(one.signals)) is one


def test_every_stretch_is_asked() -> None:
    one = dead_at_first({}, 0.5, 0.0, 1, seconds=10.0).signals
    n = len(one)

    def twice(values: Floats) -> Floats:
        return np.concatenate([values, values])

    both = Signals(
        PERIOD_S,
        twice(one.command),
        twice(one.cart),
        twice(one.pole),
        np.ones(2 * n),
        np.ones(2 * n),
        (0, n),
    )
    found = stale_s(Recording("twice", "sha256:2", both))
    assert [round(begin, 6) for begin, _ in found] == [0.0, 10.0]
    assert [end - begin for begin, end in found] == pytest.approx([0.5, 0.5], abs=0.06)


def test_a_stretch_that_ends_early_may_be_left_out_as_a_whole() -> None:
    """What goes before an early break may be another run from its first to its last sample."""
    recording = dead_at_first({}, 2.0, 0.05, 1)
    broken = replace(recording, signals=recording.signals.break_at([round(2.0 / PERIOD_S)]))
    ((begin, end),) = stale_s(broken)
    assert begin == 0.0 and end == pytest.approx(2.0, abs=0.06)
    assert (
        stale_s(replace(broken, signals=record_hidden({}, 1, 20.0)[0].signals.break_at([200])))
        == []
    )

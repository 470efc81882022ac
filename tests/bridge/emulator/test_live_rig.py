"""The emulated rig as the protocol sees it: held commands, swing-down, times of samples."""

import pytest

from pendulum_bridge.emulator.live_rig import LiveRig
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.schedule import Schedule
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.server import _share_out
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.rig import Rig

LONGEST_STEPS = 4000


@pytest.fixture
def concealed(nominal: Rig) -> Concealed:
    return Concealed({}, nominal)


def get_sample(rig: EmulatedRig) -> Sample:
    x, th, v, w = rig.sample
    return Sample(pole_rad=th, pole_rate=w, cart_m=x, cart_velocity=v)


def swing_down(rig: LiveRig) -> None:
    for _ in range(LONGEST_STEPS):
        rig.step()
        if not rig.is_swinging_down:
            return
    pytest.fail(f"swings down for more than {LONGEST_STEPS} samples")


def test_nothing_moves_before_the_first_command(concealed: Concealed) -> None:
    rig = LiveRig(concealed)
    first = rig.sample
    assert all(rig.step() == first for _ in range(50))


def test_a_command_is_held_until_the_next(concealed: Concealed) -> None:
    rig, bare = LiveRig(concealed), EmulatedRig(concealed)
    assert rig.sample == get_sample(bare)
    for pwm in (0.2, -0.35, 9.0):  # the last beyond the limit: clipped
        rig.take(Command(pwm))
        for _ in range(5):
            bare.step(pwm)
            assert rig.step() == get_sample(bare)
    assert rig.sample.cart_m != 0


def test_a_command_acts_within_a_period(concealed: Concealed) -> None:
    """A rig of twice the rate takes the same commands at its samples."""
    rig, finer = LiveRig(concealed), EmulatedRig(concealed, 200.0)
    for k in range(100):
        before, after = 0.3 * (-1.0) ** (k // 7), 0.2 * (-1.0) ** (k // 5)
        rig.take(Command(before))
        sample = rig.step([(0.5, Command(after))])
        finer.step(before)
        finer.step(after)
        other = get_sample(finer)
        assert (sample.cart_m, sample.pole_rad) == pytest.approx((other.cart_m, other.pole_rad))
    assert abs(rig.sample.cart_m) > 1e-3


def test_a_command_within_a_period_counts_for_its_share(concealed: Concealed) -> None:
    rig = EmulatedRig(concealed)
    commands = rig._list_commands(0.4, [(0.27, -0.2), (0.9, 0.1)])
    assert sum(commands) / len(commands) == pytest.approx(0.27 * 0.4 - 0.63 * 0.2 + 0.1 * 0.1)


def test_a_command_acts_after_the_share_of_the_period_in_which_it_came() -> None:
    early, late = Command(0.1), Command(0.2)
    waiting = [(early, 90), (late, 127)]  # ns; the period lasts from 100 to 200
    assert _share_out(waiting, 200, 100.0) == [(0.0, early), (pytest.approx(0.27), late)]


def test_it_becomes_another_rig_in_motion(concealed: Concealed) -> None:
    rig, changed = LiveRig(concealed), Concealed({"input_sign_inverted": {}}, concealed.rig)
    rig.take(Command(0.3))
    for _ in range(20):
        before = rig.step()
    rig.change(changed)
    first, after = rig.step(), [rig.step() for _ in range(20)][-1]
    assert before.cart_velocity > 0.1
    assert first.cart_m == pytest.approx(before.cart_m, abs=0.02), "no jump"
    assert first.cart_velocity == pytest.approx(before.cart_velocity, abs=0.1)
    assert after.cart_velocity < before.cart_velocity - 0.3, "the same command drives back"


def test_only_a_rising_edge_starts_the_swing_down(concealed: Concealed) -> None:
    rig = LiveRig(concealed)
    rig.take(Command(0.0))
    assert not rig.is_swinging_down
    rig.take(Command(0.0, reset=True))
    assert rig.is_swinging_down
    swing_down(rig)
    rig.take(Command(0.0, reset=True))  # still high: no edge
    assert not rig.is_swinging_down
    rig.take(Command(0.0))
    rig.take(Command(0.0, reset=True))
    assert rig.is_swinging_down


def test_commands_wait_until_the_swing_down_is_over(concealed: Concealed) -> None:
    rig = LiveRig(concealed)
    rig.take(Command(0.3))
    for _ in range(15):
        rig.step()
    rig.take(Command(0.0, reset=True))
    rig.take(Command(0.4))  # neither obeyed nor an end of it
    swing_down(rig)
    assert abs(rig.sample.cart_m) < 0.03 and rig.sample.cart_velocity > -0.1
    before = rig.sample.cart_m
    for _ in range(10):
        rig.step()
    assert rig.sample.cart_m > before + 0.01  # 0.4 acts now


class Clock:
    """A clock that sleeping moves on."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def now(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


def test_samples_are_due_at_whole_periods_however_long_each_took() -> None:
    clock = Clock()
    schedule = Schedule(0.01, clock.now, clock.sleep)
    times = []
    for k in range(1000):
        schedule.wait_for(k)
        times.append(clock.now_s)
        clock.sleep(0.009 if k % 3 else 0.0)
    assert times == pytest.approx([100 + 0.01 * k for k in range(1000)], abs=1e-9)
    assert schedule.given_up_s == 0


def test_a_short_delay_is_caught_up_and_a_standstill_given_up() -> None:
    clock = Clock()
    schedule = Schedule(0.01, clock.now, clock.sleep)
    clock.sleep(0.2)
    for k in range(30):
        schedule.wait_for(k)
    assert clock.now_s == pytest.approx(100.29)
    clock.sleep(5.0)
    schedule.wait_for(30)
    schedule.wait_for(31)
    assert clock.now_s == pytest.approx(105.30)
    assert schedule.given_up_s == pytest.approx(4.99)

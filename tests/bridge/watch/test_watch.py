"""The watch as a whole: it names changes, and leaves healthy rigs alone on any wire."""

import math
from copy import deepcopy
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from support.watched_rigs import (
    CHANGES,
    HANGING,
    RATE_HZ,
    Change,
    KernelRig,
    Wire,
    drive,
    make_rig,
    make_twin,
    watch_run,
)

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.watch.health import describe_health
from pendulum_bridge.watch.watch import Phase, Settings, Watch
from pendulum_twin.health import Level
from pendulum_twin.model import Twin
from pendulum_twin.stepper import Stepper

QUICK = Settings(learn_s=12.0)
POOR = Wire(jitter_s=0.002, lost=0.03)
CHANGED_S = 31.0


@pytest.fixture(scope="module")
def usual() -> Watch:
    """Return a watch that has learned the rig on which every change here is tried, until then."""
    truth = make_rig(101)
    done = watch_run(Watch(make_twin(truth, 101), QUICK), drive(KernelRig, truth, 101), CHANGED_S)
    assert done.alarm is None and done.learned_s is not None and done.learned_s < CHANGED_S
    return done.watch


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.name)
def test_a_change_is_put_in_its_place_within_seconds(usual: Watch, change: Change) -> None:
    run = drive(KernelRig, make_rig(101), 101, change, CHANGED_S)
    seen = round(CHANGED_S * RATE_HZ)
    done = watch_run(deepcopy(usual), islice(run, seen, None), CHANGED_S + 15.0)
    assert done.alarm is not None and done.alarm.place.value == change.place
    assert 31.0 < done.raised_s < 44.0
    assert 30.0 < done.alarm.since_ns * 1e-9 - 1 < done.raised_s
    if change.place == "sensor":  # a slip is seen as such, at once
        assert done.alarm.effect == "encoder_slip" and done.raised_s < 32.0
        assert done.alarm.low < 0.05 < done.alarm.high or done.alarm.size == pytest.approx(
            0.05, abs=0.003
        )


def test_a_healthy_rig_raises_no_alarm_over_a_poor_wire() -> None:
    """MuJoCo's rig with a coarse encoder, scattered stamps and lost samples."""
    truth = make_rig(6)
    encoders = Encoders(pole_counts=1024)

    def emulate(rig: Concealed, start: tuple[float, ...]) -> EmulatedRig:
        return EmulatedRig(rig, encoders=encoders, start=start, timestep_s=1e-3)

    run = drive(emulate, truth, 6)
    done = watch_run(Watch(make_twin(truth, 6), QUICK), run, 62.0, POOR, 6)
    assert done.alarm is None and done.watch.phase is Phase.WATCHING
    assert done.watch.stream.lost > 100 and done.watch.stream.begun == 1


def test_what_the_twin_lacks_already_is_no_alarm() -> None:
    """A twin that is 5 % off is held against the rig as it is, not against the truth."""
    truth = make_rig(4)
    done = watch_run(Watch(make_twin(truth, 4, off=0.05), QUICK), drive(KernelRig, truth, 4), 75.0)
    assert done.alarm is None and np.max(np.abs(done.watch.baseline.sizes)) > 0


def test_an_alarm_stays_until_it_is_cleared_or_learned() -> None:
    change = CHANGES[2]
    truth = make_rig(5)
    run, watch = drive(KernelRig, truth, 5, change, 25.0), Watch(make_twin(truth, 5), QUICK)
    first = watch_run(watch, run, 60.0).alarm
    assert first is not None and watch.phase is Phase.ALARMED
    told = describe_health(watch, "/rig", 0.0)
    assert told.level is Level.ERROR and told.sentence.startswith("/rig has changed: drive: ")
    assert (
        told.figures["place"] == "drive"
        and told.figures["unit"] == "N"
        and float(told.figures["size"]) < 0
    )
    assert watch_run(watch, islice(run, 600), 120.0).alarm is None
    assert watch.alarm is not None and watch.alarm.raised_ns == first.raised_ns
    assert watch.alarm.size == pytest.approx(-0.15 * truth.rig.force_per_pwm_n, rel=0.1)
    watch.clear()
    cleared_ns = watch.stream.stamp_ns
    assert watch.phase is Phase.WATCHING and describe_health(watch, "/rig", 0.0).level is Level.OK
    again = watch_run(watch, run, 120.0)
    assert again.alarm is not None and again.alarm.place is first.place
    assert again.alarm.raised_ns - cleared_ns >= 10**9  # from new windows, not from those before
    watch.learn()  # takes the change for usual
    assert watch.phase is Phase.LEARNING and watch.alarm is None
    assert (
        watch_run(watch, islice(run, 2600), 200.0).alarm is None and watch.phase is Phase.WATCHING
    )


def test_an_alarm_is_named_again_though_the_clock_was_set_back(usual: Watch) -> None:
    watch, run = deepcopy(usual), drive(KernelRig, make_rig(101), 101, CHANGES[2], CHANGED_S)
    raised, back_ns = None, 0
    for number, positions, command in islice(run, round(CHANGED_S * RATE_HZ), None):
        now_ns = 10**9 + number * 10**7 - back_ns
        if watch.sample(now_ns, now_ns, positions) is not None:
            raised, back_ns = number, 20 * 10**9
        watch.command(command, now_ns + 10**6)
        if watch._named_again or (raised is not None and number > raised + 1000):
            break
    assert watch._named_again and 400 <= number - raised < 600


def test_nothing_is_learned_at_rest() -> None:
    watch = Watch(make_twin(make_rig(1), 1), QUICK)
    for k in range(3000):
        watch.sample(k * 10**7, k * 10**7, (0.0, math.pi))
    assert watch.phase is Phase.LEARNING and watch.learned_s == 0.0
    assert (
        describe_health(watch, "/rig", 0.0).sentence
        == "/rig: learns what is usual, 0 of 12 s of motion"
    )


def test_a_reset_of_the_rig_is_no_change() -> None:
    truth = make_rig(2)
    run, watch = drive(KernelRig, truth, 2), Watch(make_twin(truth, 2), QUICK)
    assert watch_run(watch, islice(run, 3000), 60.0).alarm is None
    rig = KernelRig(truth, HANGING)
    for k in range(3000, 4500):
        command = 0.3 * math.sin(0.08 * k)
        assert watch.sample(10**9 + k * 10**7, 10**9 + k * 10**7, rig.sample[:2]) is None
        watch.command(command, 10**9 + k * 10**7 + 10**6)
        rig.step(command)
    assert watch.stream.begun == 2 and watch.phase is Phase.WATCHING


@pytest.mark.parametrize("joint", ["cart", "pole"])
def test_a_rig_with_one_joint_is_watched_too(joint: str) -> None:
    rig = make_rig(7).rig
    poleless = dict.fromkeys(
        ("pole_mass_kg", "com_distance_m", "pole_inertia_kg_m2", "pole_viscous_n_m_s")
    )
    cartless = dict.fromkeys(
        (
            "cart_mass_kg",
            "force_per_pwm_n",
            "cart_viscous_n_s_m",
            "rail_half_length_m",
            "pwm_limit",
        )
    )
    alone = (
        replace(rig, **poleless)
        if joint == "cart"
        else replace(rig, **cartless, com_distance_m=0.11)
    )
    key = {"cart": "force_per_pwm_n", "pole": "pole_viscous_n_m_s"}[joint]
    after = replace(alone, **{key: getattr(alone, key) * {"cart": 0.8, "pole": 4.0}[joint]})
    watch, stepper, column = Watch(Twin("one", alone), QUICK), None, ("cart", "pole").index(joint)
    for k in range(6000):
        if k in (0, 3000):
            start = HANGING if stepper is None else tuple(stepper.state)
            stepper = Stepper(Twin("one", alone if k == 0 else after), 1 / RATE_HZ, start)
        if joint == "pole" and k % 1000 == 0:  # it is let go anew
            stepper.reset((0.0, math.pi + 1.2, 0.0, 0.0))
        positions = [math.nan, math.nan]
        positions[column] = round(float(stepper.state[column]) / 1e-4) * 1e-4
        alarm = watch.sample(k * 10**7, k * 10**7, positions)
        if alarm is not None:
            assert k > 3000 and alarm.place.value == {"cart": "drive", "pole": "pole"}[joint]
            return
        command = 0.3 * math.sin(0.09 * k) if joint == "cart" else 0.0
        watch.command(command, k * 10**7 + 1)
        stepper.step(command)
    raise AssertionError("no alarm")


@pytest.mark.parametrize(
    ("factor", "silent_s", "level", "said"),
    [
        (1.0, None, Level.WARN, "/rig: no samples yet"),
        (1.0, 3.0, Level.WARN, "/rig: no samples for 3.0 s"),
        (2.0, 0.0, Level.ERROR, "/rig: expected samples at 100 Hz, found 50 Hz: set rate_hz"),
    ],
)
def test_what_keeps_it_from_watching_is_said(
    factor: float, silent_s: float | None, level: Level, said: str
) -> None:
    watch = Watch(make_twin(make_rig(1), 1), QUICK)
    for k in range(0 if silent_s is None else 200):
        watch.sample(round(k * 10**7 * factor), k * 10**7, (0.0, math.pi))
    told = describe_health(watch, "/rig", silent_s)
    assert (told.level, told.sentence) == (level, said)

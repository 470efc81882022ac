"""Impossible readings are found, and none of a rig that only differs from its constants."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.guarded_rigs import PERIOD_S, stepper, varied
from support.paths import CONFIG

from pendulum_bridge.emulator import sensors
from pendulum_bridge.emulator.conceal import draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.session import play_plan
from pendulum_bridge.safety.encoder_check import (
    EncoderCheck,
    Encoders,
    check_sample,
    make_encoder_check,
    trust_again,
)
from pendulum_bridge.safety.encoder_jump import UNEVEN_SLACK_PERIODS
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

NOMINAL = load_twin(CONFIG / "inteco.yaml").rig
CHECK = make_encoder_check(NOMINAL, 0.5, PERIOD_S)
REST = RigState(0.1, math.pi, 0.0, 0.0)
COARSE = sensors.Encoders(pole_counts=1024, cart_step_m=400e-6)
SETTLED = 30  # samples after which the reported velocities know of a start in motion
Command = Callable[[int], float]
Wrong = Callable[[int, RigState], RigState]


def draw_steps(size: float, samples: int) -> Command:
    return lambda k: size * (-1) ** (k // samples)


def measure_run(
    rig: Rig,
    effects: dict,
    command: Command,
    count: int,
    encoders: sensors.Encoders,
    jump: tuple[float, float] = (0.0, 0.0),
    jumps_at: int = 300,
    start: tuple[float, float, float, float] = (0.0, math.pi, 0.0, 0.0),
) -> list[RigState]:
    """Return what a rig shows to the emulator's sensors, with a jump (m, rad) from then on."""
    moved, meter = stepper(rig, effects, start), sensors.Sensors(encoders, {}, PERIOD_S)
    shown = []
    for k in range(count):
        shown.append(
            RigState(
                *map(
                    float,
                    meter.measure(moved.state + np.array([*jump, 0.0, 0.0]) * (k >= jumps_at)),
                )
            )
        )
        moved.step(command(k))
    return shown


def follow(shown: list[RigState], command: Command, check: EncoderCheck = CHECK) -> list[Encoders]:
    """Return the state after each sample."""
    claim = [Encoders()]
    for k, sample in enumerate(shown):
        applied = command(k - 1) if k else 0.0
        claim.append(check_sample(claim[-1], sample, applied, PERIOD_S, check))
    return claim[1:]


def find_first_fault(
    states: list[Encoders], but: Reason | None = None
) -> tuple[int, Reason] | None:
    return next(
        (
            (k, checked.fault)
            for k, checked in enumerate(states)
            if checked.fault not in (None, but)
        ),
        None,
    )


@pytest.mark.parametrize(
    ("seed", "effects", "encoders"), [(1, 2, COARSE), (12, 3, sensors.Encoders())]
)
def test_no_alarm_in_concealed_rigs(seed: int, effects: int, encoders: sensors.Encoders) -> None:
    log = play_plan(
        EmulatedRig(draw_concealed(seed, effects, NOMINAL), 100.0, encoders, timestep_s=1e-3),
        make_standard_plan(seconds=40.0, seed=seed),
    )
    shown = [
        RigState(*map(float, [*p, *v])) for p, v in zip(log.positions, log.velocities, strict=True)
    ]
    states = follow(shown, lambda k: float(log.commands[k]))
    assert find_first_fault(states) is None and states[-1].spikes == 0


def test_no_alarm_in_rigs_as_wrong_as_is_believed_possible() -> None:
    """Constants 30 % off, dry friction up to 2 N, and commands that hardly overcome it, or do."""
    random = np.random.default_rng(5)
    for trial in range(40):
        rig = varied(NOMINAL, random, corner=trial % 2 == 0)
        effects = {
            "cart_coulomb_friction": {"level_n": random.uniform(0, 2.0)},
            "pole_coulomb_friction": {"level_n_m": random.uniform(0, 0.01)},
        }
        command = draw_steps(
            random.choice([0.1, 0.2, 0.25, 0.3, 0.4, 0.5]), random.choice([12, 30, 60, 1000])
        )
        shown = measure_run(
            rig, effects, command, 800, COARSE if trial % 3 else sensors.Encoders()
        )
        assert find_first_fault(follow(shown, command)) is None, f"trial {trial}: {rig}"


def swing(
    count: int = 400, jump: tuple[float, float] = (0.0, 0.0)
) -> tuple[list[RigState], Command]:
    """Return a rig driven hard enough that both its joints move fast; jump: see `measured`."""
    command = draw_steps(0.4, 25)
    return measure_run(NOMINAL, {}, command, count, COARSE, jump), command


@pytest.mark.parametrize("samples", [1, 3])
@pytest.mark.parametrize(
    ("cart_m", "pole_rad"), [(0.05, 0.0), (0.0, 0.5), (0.0, -math.tau), (-0.05, 1.0)]
)
def test_a_spike_is_pwm_0_until_it_is_back(cart_m: float, pole_rad: float, samples: int) -> None:
    shown, command = swing()
    wrong = slice(300, 300 + samples)
    shown[wrong] = [
        replace(s, cart_m=s.cart_m + cart_m, pole_rad=s.pole_rad + pole_rad) for s in shown[wrong]
    ]
    states = follow(shown, command)
    assert [
        k for k, checked in enumerate(states) if checked.fault is Reason.ENCODER_SPIKE
    ] == list(range(300, 300 + samples))
    assert find_first_fault(states, but=Reason.ENCODER_SPIKE) is None and states[-1].spikes == 1


@pytest.mark.parametrize(
    ("cart_m", "pole_rad"), [(0.08, 0.0), (-0.3, 0.0), (0.0, 0.5), (0.0, math.tau)]
)
def test_a_jump_that_stays_is_latched_until_somebody_clears_it(
    cart_m: float, pole_rad: float
) -> None:
    shown, command = swing(
        jump=(cart_m, pole_rad)
    )  # the velocities that are reported jump as well
    states = follow(shown, command)
    assert find_first_fault(states) == (300, Reason.ENCODER_SPIKE)
    assert find_first_fault(states, but=Reason.ENCODER_SPIKE) == (306, Reason.ENCODER_JUMPED)
    assert {checked.fault for checked in states[306:]} == {Reason.ENCODER_JUMPED}
    cleared = trust_again(states[-1])
    assert cleared.fault is None and cleared.spikes == 1
    assert check_sample(cleared, shown[-1], 0.0, PERIOD_S, CHECK).fault is None


def test_a_jump_of_a_moving_cart_that_lags_behind_its_way_is_latched() -> None:
    """After four more samples the cart has gone the way that it had jumped back."""
    shown = [RigState(0.01 * k - (0.04 if k >= 30 else 0.0), math.pi, 1.0, 0.0) for k in range(60)]
    states = follow(shown, lambda k: 0.0)
    assert find_first_fault(states, but=Reason.ENCODER_SPIKE) is not None
    assert states[-1].fault is Reason.ENCODER_JUMPED and states[-1].spikes == 1


def test_a_jump_back_after_it_was_latched_changes_nothing() -> None:
    shown, command = swing()
    shown[300:320] = [replace(s, cart_m=s.cart_m + 0.2) for s in shown[300:320]]
    assert follow(shown, command)[-1].fault is Reason.ENCODER_JUMPED


def test_spikes_of_the_emulator_are_found_with_the_velocities_that_they_spoil() -> None:
    moved = stepper(NOMINAL, {}, (0.0, math.pi, 0.0, 0.0))
    meter = sensors.Sensors(sensors.Encoders(spike_rate=0.03), {}, PERIOD_S, seed=4)
    exact = sensors.Sensors(sensors.Encoders(), {}, PERIOD_S)
    command, shown, wrong = draw_steps(0.4, 25), [], []
    for k in range(1500):
        shown.append(RigState(*map(float, meter.measure(moved.state))))
        wrong.append(abs(shown[-1].cart_m - exact.measure(moved.state)[0]) > 0.04)
        moved.step(command(k))
    states = follow(shown, command)
    assert sum(wrong) > 30
    assert [checked.fault for checked in states] == [
        Reason.ENCODER_SPIKE if checked else None for checked in wrong
    ]


def test_a_spike_among_the_first_samples_does_not_condemn_the_rest() -> None:
    for at in range(4):
        shown, command = swing(100)
        shown[at] = replace(shown[at], cart_m=shown[at].cart_m + 0.5)
        states = follow(shown, command)
        assert (
            find_first_fault(states, but=Reason.ENCODER_SPIKE) is None and states[-1].fault is None
        )


@pytest.mark.parametrize("lost", [1, 5, 20])
def test_lost_samples_are_no_jump(lost: int) -> None:
    shown, command = swing()
    encoders = Encoders()
    for k, sample in enumerate(shown):
        if not 200 <= k < 200 + lost:
            encoders = check_sample(
                encoders,
                sample,
                command(k - 1),
                PERIOD_S * (lost + 1 if k == 200 + lost else 1),
                CHECK,
            )
            assert encoders.fault is None


def test_a_burst_with_a_sample_missing_is_no_jump() -> None:
    shown, command = swing()
    encoders = Encoders()
    for k, sample in enumerate(shown):
        if k == 205:
            continue
        passed_s = 12 * PERIOD_S if k == 200 else 1e-4 if 200 < k < 212 else PERIOD_S
        encoders = check_sample(encoders, sample, command(k - 1), passed_s, CHECK)
        assert encoders.fault is None


@pytest.mark.parametrize("pwm", [0.4, -0.4, 0.5])
def test_a_cart_that_stands_still_though_it_is_pushed_is_stuck(pwm: float) -> None:
    claim = find_first_fault(follow([REST] * 300, lambda _: pwm))
    assert claim is not None and claim[1] is Reason.CART_STUCK
    print(f"PWM {pwm}: stuck cart found after {1e3 * PERIOD_S * claim[0]:.0f} ms")
    assert claim[0] * PERIOD_S < 0.4


@pytest.mark.parametrize("pwm", [0.0, 0.1, 0.22])
def test_what_dry_friction_can_hold_is_not_stuck(pwm: float) -> None:
    assert find_first_fault(follow([REST] * 2000, lambda _: pwm)) is None


def test_a_cart_at_the_end_of_the_rail_may_be_held_by_it() -> None:
    assert find_first_fault(follow([replace(REST, cart_m=0.85)] * 500, lambda _: 0.5)) is None


def test_a_cart_may_be_held_by_a_pole_that_spins_but_not_for_ever() -> None:
    """What a spinning pole takes up is bounded by its momentum, and a steady push goes on."""
    spinning = [replace(REST, pole_rad=0.2 * k, pole_rad_s=20.0) for k in range(300)]
    claim = find_first_fault(follow(spinning, lambda _: 0.4))
    assert claim is not None and claim[1] is Reason.CART_STUCK and 0.4 < claim[0] * PERIOD_S < 1.0
    assert find_first_fault(follow(spinning, lambda _: 0.2)) is None


def whirl(
    rig: Rig, effects: dict, command: Command, encoders: sensors.Encoders, rate_rad_s: float
) -> list[RigState]:
    """Return what a rig shows after its pole was let go fast, once its velocities have settled."""
    start = (-0.7 * math.copysign(1, command(0)), 2.0, 0.0, rate_rad_s)
    return measure_run(
        rig, effects, lambda k: command(max(k - SETTLED, 0)), 300, encoders, start=start
    )[SETTLED:]


@pytest.mark.parametrize("rate_rad_s", [-18.0, -8.0, 8.0, 18.0])
def test_a_stuck_cart_is_found_however_the_pole_whirls(rate_rad_s: float) -> None:
    command = draw_steps(0.4, 1000)
    shown = whirl(NOMINAL, {}, command, COARSE, rate_rad_s)
    took_s = []
    for at in (5, 20, 35):
        claim = find_first_fault(follow(freeze("cart", at, shown), command))
        assert claim is not None and claim[1] in (
            Reason.CART_STUCK,
            Reason.POLE_STUCK,
        )  # a dead velocity looks like braking
        took_s.append((claim[0] - at) * PERIOD_S)
    print(f"pole at {rate_rad_s} rad/s: stuck cart found after at most {1e3 * max(took_s):.0f} ms")
    assert 0.05 < max(took_s) < 0.9


def test_no_alarm_while_a_pole_whirls_on_rigs_as_wrong_as_is_believed_possible() -> None:
    """Pushes that dry friction nearly holds, with the pole's pull for and against them."""
    random = np.random.default_rng(8)
    for trial in range(60):
        rig = varied(NOMINAL, random, corner=trial % 2 == 0)
        effects = {"cart_coulomb_friction": {"level_n": random.uniform(1.0, 2.0)}}
        command = draw_steps(
            random.choice([0.1, 0.15, 0.2, 0.25, 0.3, 0.5]), random.choice([12, 30, 1000])
        )
        encoders = COARSE if trial % 3 else sensors.Encoders()
        shown = whirl(rig, effects, command, encoders, random.uniform(-20, 20))
        assert find_first_fault(follow(shown, command)) is None, f"trial {trial}: {rig}"


def test_a_level_pole_may_stand_still_while_the_cart_is_shaken() -> None:
    shown, command = swing()
    level = [replace(s, pole_rad=math.pi / 2, pole_rad_s=0.0) for s in shown]
    assert find_first_fault(follow(level, command)) is None
    hanging = [replace(s, pole_rad=math.pi, pole_rad_s=0.0) for s in shown]
    assert find_first_fault(follow(hanging, command)) is not None


def test_less_friction_believed_finds_a_stuck_cart_at_smaller_commands() -> None:
    check = make_encoder_check(NOMINAL, 0.5, PERIOD_S, dry_n=0.5)
    assert find_first_fault(follow([REST] * 100, lambda _: 0.15, check)) is not None


def freeze(joint: str, at: int, shown: list[RigState]) -> list[RigState]:
    """Return the samples with a dead encoder: constant position, velocity filtered to 0."""
    names = ("cart_m", "cart_m_s") if joint == "cart" else ("pole_rad", "pole_rad_s")
    there = shown[at]
    return shown[:at] + [
        replace(
            s,
            **{
                names[0]: getattr(there, names[0]),
                names[1]: getattr(there, names[1]) * math.exp(-0.5 * k),
            },
        )
        for k, s in enumerate(shown[at:])
    ]


def test_a_pole_that_stands_still_while_the_cart_is_shaken_is_stuck() -> None:
    """At a level reading the cart's acceleration need not move the pole: nothing is claimed."""
    shown, command = swing(500)
    took_s = []
    for at in range(200, 380, 5):
        claim = find_first_fault(follow(freeze("pole", at, shown), command))
        if abs(math.cos(shown[at].pole_rad)) > 0.7:
            assert claim is not None and claim[1] is Reason.POLE_STUCK
            took_s.append((claim[0] - at) * PERIOD_S)
    print(
        f"stuck pole found after {1e3 * np.median(took_s):.0f} ms, at most "
        f"{1e3 * max(took_s):.0f} ms"
    )
    assert len(took_s) > 8 and max(took_s) < 0.7


def test_the_same_sample_again_and_again_is_stuck() -> None:
    """But for a sample in which a joint stands, as at a turning point: no claim on it."""
    shown, command = swing()
    moving = [at for at in range(200, 300, 9) if shown[at].pole_rad_s != 0.0]
    assert len(moving) > 8
    for at in moving:
        claim = find_first_fault(follow(shown[:at] + [shown[at]] * 30, command))
        assert (
            claim is not None
            and claim[1] in (Reason.CART_STUCK, Reason.POLE_STUCK)
            and claim[0] - at <= 10
        )


@pytest.mark.parametrize("speed", [0.05, -0.05])
@pytest.mark.parametrize("reason", [Reason.CART_STUCK, Reason.POLE_STUCK])
def test_the_same_sample_is_stuck_whichever_way_it_moves(reason: Reason, speed: float) -> None:
    cart = reason is Reason.CART_STUCK
    sample = RigState(0.1, math.pi, speed if cart else 0.0, 0.0 if cart else 3 * speed)
    states = follow([sample] * 100, lambda k: 0.0)
    assert states[9].fault is None and states[-1].fault is reason


@pytest.mark.parametrize("joint", ["cart", "pole"])
def test_even_motion_slower_than_the_encoder_counts_is_not_stuck(joint: str) -> None:
    """Eleven samples alike and then a step, again and again: each way counts for itself."""
    shown = []
    for k in range(200):
        steps = k // 11 * 11 * PERIOD_S
        if joint == "cart":
            shown.append(RigState(0.017 * steps, math.pi, 0.017, 0.0))
        else:
            shown.append(RigState(0.1, math.pi + 0.1 * steps, 0.0, 0.1))
    assert find_first_fault(follow(shown, lambda k: 0.0)) is None


@pytest.mark.parametrize(("cart_kg", "found_s"), [(NOMINAL.cart_mass_kg, 0.14), (10.0, 0.28)])
def test_a_heavy_cart_has_the_time_that_its_mass_needs(cart_kg: float, found_s: float) -> None:
    """The drive moves 13 kg at most by 2 mm at least in this time, through its lag."""
    before, mass_kg = NOMINAL.total_mass_kg, cart_kg + NOMINAL.pole_mass_kg
    distance_m = NOMINAL.com_distance_m * before / mass_kg
    rig = replace(NOMINAL, cart_mass_kg=cart_kg, com_distance_m=distance_m)
    states = follow([REST] * 100, lambda k: 0.5, make_encoder_check(rig, 0.5, PERIOD_S))
    k, reason = find_first_fault(states)
    assert reason is Reason.CART_STUCK and k * PERIOD_S == pytest.approx(found_s, abs=0.015)


def test_stuck_stays_until_somebody_clears_it() -> None:
    states = follow([REST] * 100, lambda _: 0.5)
    moving = check_sample(states[-1], replace(REST, cart_m=0.101), 0.0, PERIOD_S, CHECK)
    assert moving.fault is Reason.CART_STUCK and trust_again(moving).fault is None


def test_a_spike_takes_no_latched_fault_away() -> None:
    stuck = follow([REST] * 30, lambda k: 0.5)[-1]
    assert stuck.fault is Reason.CART_STUCK
    for sample in (replace(REST, cart_m=0.5), REST, REST):
        stuck = check_sample(stuck, sample, 0.0, PERIOD_S, CHECK)
        assert stuck.fault is Reason.CART_STUCK
    assert stuck.spikes == 1


def test_after_a_spike_nothing_is_said_about_stuck_encoders_for_a_while() -> None:
    """The velocity that a spike of the cart leaves would say that the resting pole has to move."""
    meter = sensors.Sensors(
        sensors.Encoders(spike_rate=0.02, spike_m=0.2, spike_rad=0.0), {}, PERIOD_S, seed=1
    )
    shown = [
        RigState(*map(float, meter.measure(np.array([0.0, math.pi, 0.0, 0.0]))))
        for _ in range(1000)
    ]
    states = follow(shown, lambda _: 0.0)
    assert find_first_fault(states, but=Reason.ENCODER_SPIKE) is None and states[-1].spikes > 5


def test_every_fault_has_its_level_and_says_what_to_do() -> None:
    assert Reason.ENCODER_SPIKE.level is Level.WARN
    for reason in (Reason.ENCODER_JUMPED, Reason.CART_STUCK, Reason.POLE_STUCK):
        assert reason.level is Level.ERROR
        assert "PWM is 0" in reason.sentence and "then stop and clear the stop" in reason.sentence


def test_a_rig_without_a_cart_is_refused_and_one_without_a_pole_is_not() -> None:
    pole = Rig(
        pole_mass_kg=0.1, com_distance_m=0.1, pole_inertia_kg_m2=0.01, pole_viscous_n_m_s=0.0
    )
    with pytest.raises(
        BadInputError, match="encoder check: expected a rig with a cart, found none"
    ):
        make_encoder_check(pole, 0.5, PERIOD_S)
    cart = make_encoder_check(
        Rig(cart_mass_kg=1.0, force_per_pwm_n=10.0, cart_viscous_n_s_m=1.0), 0.5, PERIOD_S
    )
    assert (
        find_first_fault(
            follow([replace(REST, pole_rad=float(k)) for k in range(50)], lambda _: 0.0, cart)
        )
        is None
    )
    assert find_first_fault(follow([REST] * 100, lambda _: 0.5, cart)) is not None


def test_no_rig_accelerates_faster_than_is_believed() -> None:
    """Over 1 ms, in random states, with the largest command and the constants 30 % off."""
    random, nearest = np.random.default_rng(6), np.zeros(2)
    for _ in range(400):
        rig = varied(NOMINAL, random, corner=True)
        start = random.uniform(-1, 1, 4) * [0.5, math.pi, 2.0, 25.0]
        effects = {
            "cart_coulomb_friction": {"level_n": 2.0},
            "pole_coulomb_friction": {"level_n_m": 0.01},
        }
        moved = Stepper(Twin("random", rig, effects), 0.001, tuple(start))
        after_it = moved.step(float(random.choice([-0.5, 0.5])))
        rate, reach = max(abs(start[3]), abs(after_it[3])), CHECK.reach
        cart = reach.cart_m_s2 + reach.cart_1_s * abs(start[2]) + reach.cart_m * rate**2
        pole = reach.pole_rad_s2 + reach.pole_1_m * abs(start[2]) + reach.pole_1 * rate**2
        nearest = np.maximum(nearest, np.abs(after_it[2:] - start[2:]) / 0.001 / [cart, pole])
    print(f"largest accelerations of cart and pole, as shares of the bound: {nearest.round(2)}")
    assert np.all(nearest < 1) and np.all(nearest > 0.4)


@given(
    kicks=st.lists(
        st.tuples(
            st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(0, 10)
        ),
        max_size=30,
    )
)
def test_whatever_comes_a_latched_fault_stays_and_spikes_only_grow(
    kicks: list[tuple[float, ...]],
) -> None:
    encoders = Encoders()
    for cart_m, pole_rad, velocity, passed_s in kicks:
        before = encoders
        encoders = check_sample(
            encoders, RigState(cart_m, pole_rad, velocity, velocity), 0.5, passed_s, CHECK
        )
        assert encoders.spikes >= before.spikes
        if before.fault not in (None, Reason.ENCODER_SPIKE):
            assert encoders.fault is before.fault


@given(passed_s=st.floats(0, 0.2), late=st.floats(0, UNEVEN_SLACK_PERIODS * PERIOD_S))
def test_even_motion_is_never_a_jump_however_its_time_is_told(
    passed_s: float, late: float
) -> None:
    """A pole at 25 rad/s, of which a step took up to three periods longer than told."""
    encoders, angle = Encoders(), 3.0
    for k in range(40):
        told_s = passed_s if k == 20 else PERIOD_S
        angle += 25.0 * (
            told_s + (late if k == 20 and abs(passed_s - PERIOD_S) > PERIOD_S / 2 else 0.0)
        )
        encoders = check_sample(encoders, RigState(0.0, angle, 0.0, 25.0), 0.0, told_s, CHECK)
        assert encoders.fault is None

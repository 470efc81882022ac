"""Gain, latency and limit of a made-up cart are measured despite friction, dead zone and lag."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from support.doctor_bench import TWIN

from pendulum_bridge.doctor.derivatives import check_order, check_velocities_moving, fit_derivative
from pendulum_bridge.doctor.directions import measure_pole_answer
from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.held_signal import HeldSignal
from pendulum_bridge.doctor.response import (
    Response,
    check_acceleration,
    check_clipping,
    check_latency,
    measure_response,
)
from pendulum_bridge.doctor.track import Grid, Track, resample

PERIOD_S, FINE = 0.01, 50
SMALL = 0.2
STEP_M = 57e-6


@dataclass(frozen=True)
class Cart:
    """A made-up cart: gain (m/s^2 a unit), delay_s, lag_s, dead (PWM), dry (m/s^2), most (PWM)."""

    gain: float = 18.6
    delay_s: float = 0.0
    lag_s: float = 0.0
    dead: float = 0.0
    dry: float = 0.0
    most: float = 1.0


def make_commands() -> np.ndarray:
    """Return doublets, two small and one large, each after a pause: one command a sample."""
    doublet = np.repeat([1.0, -1.0, -1.0, 1.0], 12)
    kick = np.repeat([1.0, -1.0, -1.0, 1.0], 7)
    pause = np.zeros(30)
    return np.concatenate([pause, 0.1 * doublet, pause, 0.19 * doublet, pause, 0.5 * kick, pause])


def drive_cart(cart: Cart, swing_rad: float = 0.0) -> Track:
    """Return what the cart does, in steps of a fiftieth of the period, measured in encoder steps.

    swing_rad: how far a pole swings, and shakes the cart about the centre of mass, which is what
    the drive moves.
    """
    u, step = np.repeat(make_commands(), FINE), PERIOD_S / FINE
    u = np.concatenate([np.zeros(round(cart.delay_s / step)), u])[: len(u)]
    viscous = (TWIN.rig.cart_viscous_n_s_m or 0.0) / TWIN.rig.total_mass_kg
    x = v = lagged = 0.0
    shown = []
    for k, command in enumerate(u):
        if k % FINE == 0:
            shown.append(round(x / STEP_M) * STEP_M)
        lagged = command if not cart.lag_s else lagged + (command - lagged) * step / cart.lag_s
        drive = cart.gain * math.copysign(
            max(min(abs(lagged), cart.most) - cart.dead, 0.0), lagged
        )
        if v == 0.0 and abs(drive) <= cart.dry:
            continue
        friction = math.copysign(cart.dry, v if v else drive)
        faster = v + (drive - friction - viscous * v) * step
        v = 0.0 if v * faster < 0 else faster
        x += v * step
    times = 3.0 + PERIOD_S * np.arange(len(shown))
    samples = np.zeros((len(shown), 4))
    samples[:, 0] = math.pi + swing_rad * np.sin(9 * times)
    samples[:, 2] = np.array(shown) + (TWIN.rig.com_distance_m or 0.0) * np.sin(samples[:, 0])
    return Track(times, samples, times, make_commands())


def measure(track: Track) -> Response:
    return measure_response(track, resample(track, PERIOD_S), TWIN.rig, 1, SMALL)


@pytest.mark.parametrize(
    "cart",
    [
        Cart(),
        Cart(gain=-9.0),
        Cart(delay_s=0.035),
        Cart(lag_s=0.045),
        Cart(dead=0.04),
        Cart(dry=0.8),
        Cart(gain=-25.0, delay_s=0.02, dead=0.02, dry=0.5, most=0.3),
        Cart(most=0.25),
    ],
    ids=str,
)
def test_what_was_made_up_is_found(cart: Cart) -> None:
    response = measure(drive_cart(cart))
    assert response.is_sure
    assert response.gain == pytest.approx(cart.gain, rel=0.1)
    assert response.latency_s == pytest.approx(cart.delay_s + cart.lag_s, abs=0.006)
    assert response.effect == pytest.approx(min(cart.most, 0.5), rel=0.06)
    assert response.strongest == 0.5


def test_a_swinging_pole_does_not_matter() -> None:
    response = measure(drive_cart(Cart(delay_s=0.02), swing_rad=1.0))
    assert (response.gain, response.latency_s) == (
        pytest.approx(18.6, rel=0.1),
        pytest.approx(0.02, abs=0.006),
    )


def test_jitter_and_losses_do_not_matter() -> None:
    track = drive_cart(Cart(delay_s=0.03))
    late = np.random.default_rng(3).uniform(0, 0.004, len(track.arrivals))
    kept = np.delete(np.arange(len(late)), [60, 90, 131, 132])
    response = measure(
        Track((track.arrivals + late)[kept], track.samples[kept], track.sent_at, track.sent)
    )
    assert response.gain == pytest.approx(18.6, rel=0.1)
    assert response.latency_s == pytest.approx(0.03, abs=0.008)


@pytest.mark.parametrize("late_s", [0.0, 0.004, 0.01, 0.02])
def test_how_the_latency_scatters_from_step_to_step(late_s: float) -> None:
    """Each change of the command is sent earlier, by another time, than it acts."""
    random, spreads, true = np.random.default_rng(2), [], []
    track = drive_cart(Cart(delay_s=0.03, dry=0.3))
    steps = np.flatnonzero(np.diff(track.sent, prepend=0.0))
    for _ in range(8):
        early = np.zeros(len(track.sent))
        early[steps] = random.uniform(0, late_s, len(steps))
        response = measure(Track(track.arrivals, track.samples, track.sent_at - early, track.sent))
        assert response.spread_s is not None
        spreads.append(response.spread_s)
        true.append(np.std(early[steps]))
    assert np.mean(spreads) == pytest.approx(np.mean(true), rel=0.5, abs=0.001)
    finding = check_latency(response, PERIOD_S)
    assert finding.to_mapping()["figures"]["spread_s"] == response.spread_s
    assert "ms from step to step" in finding.observed


def test_a_cart_that_hardly_moves_tells_nothing() -> None:
    still = measure(drive_cart(Cart(gain=0.01)))
    assert not still.is_sure
    findings = [
        check_latency(still, PERIOD_S),
        check_acceleration(still, 18.6, 10.0, 34.0),
        check_clipping(still, 0.5),
    ]
    assert {finding.verdict for finding in findings} == {Verdict.SKIPPED}


@pytest.mark.parametrize(("gain", "fault"), [
    (18.0, None), (-18.0, None), (13.0, Fault.GAIN_OFF), (40.0, Fault.GAIN_UNSAFE),
                                             (9.0, Fault.GAIN_UNSAFE)])  # fmt: skip
def test_a_gain_is_judged_by_what_the_guard_believes(gain: float, fault: Fault | None) -> None:
    finding = check_acceleration(Response(0.0, gain, 0.1, 0.5, 0.5), 18.6, 10.0, 34.5)
    assert finding.fault is fault


def test_latency_and_clipping_are_judged() -> None:
    assert check_latency(Response(0.024, 18.6, 0.1, 0.5, 0.5), PERIOD_S).fault is None
    assert check_latency(Response(0.03, 18.6, 0.1, 0.5, 0.5), PERIOD_S).fault is Fault.SLOW_ANSWER
    assert check_clipping(Response(0.0, 18.6, 0.1, 0.5, 0.45), 0.5).fault is None
    assert check_clipping(Response(0.0, 18.6, 0.1, 0.5, 0.35), 0.5).fault is Fault.CLIPPED
    assert check_clipping(Response(0.0, 18.6, 0.1, 0.2, None), 0.5).verdict is Verdict.SKIPPED


def test_means_are_the_triangular_ones() -> None:
    signal = HeldSignal(np.array([1.0, 1.1]), np.array([2.0, 0.0]), 0.0, 0.02, PERIOD_S)
    assert signal.average_around(np.array([0.9, 1.0, 1.05, 1.1, 1.2])) == pytest.approx(
        [0.0, 1.0, 2.0, 1.0, 0.0], abs=0.15
    )
    lagging = HeldSignal(np.array([1.0, 2.0]), np.array([1.0, 0.0]), 0.05, 0.02, PERIOD_S)
    assert lagging.average_around(np.array([1.1, 1.3])) == pytest.approx(
        [1 - math.exp(-2), 1 - math.exp(-6)], abs=0.03
    )


def moving(
    pole_rate: float = 1.0, cart_velocity: float = 1.0, columns: tuple[int, ...] = (0, 1, 2, 3)
) -> Grid:
    """Return two sines as pole and cart, with the rates scaled and the columns reordered."""
    t = PERIOD_S * np.arange(150)
    pole, cart = math.pi + 0.1 * np.sin(6 * t), 0.02 * np.sin(4 * t)
    rates = pole_rate * 0.6 * np.cos(6 * t), cart_velocity * 0.08 * np.cos(4 * t)
    return Grid(t, np.stack([pole, rates[0], cart, rates[1]], axis=1)[:, columns], PERIOD_S)


def test_rates_that_follow_their_positions_are_right() -> None:
    assert check_order(moving()).fault is None and check_velocities_moving(moving()).fault is None
    assert (
        check_velocities_moving(moving()).observed
        == "pole rate 1.00 times, cart velocity 1.00 times"
    )


@pytest.mark.parametrize(("pole_rate", "cart_velocity", "words"), [
    (-1.0, 1.0, "pole rate -1.00 times"), (1.0, 100.0, "cart velocity 99.9"),
    (57.3, 1.0, "pole rate 57."),
    (0.0, 1.0, "pole rate that has nothing to do with them"),
])  # fmt: skip
def test_a_rate_of_a_wrong_sign_or_unit_is_found(
    pole_rate: float, cart_velocity: float, words: str
) -> None:
    finding = check_velocities_moving(moving(pole_rate, cart_velocity))
    assert finding.fault is Fault.VELOCITY_WRONG and words in finding.observed


@pytest.mark.parametrize("columns", [(0, 2, 1, 3), (0, 2, 3, 1), (1, 0, 3, 2), (2, 0, 3, 1)])
def test_fields_in_another_order_are_found(columns: tuple[int, ...]) -> None:
    assert check_order(moving(columns=columns)).fault is Fault.FIELDS_MIXED


def test_a_wrapped_angle_is_found() -> None:
    grid = moving()
    angles = np.where(
        grid.samples[:, 0] > math.pi, grid.samples[:, 0] - math.tau, grid.samples[:, 0]
    )
    samples = np.column_stack([angles, grid.samples[:, 1:]])
    assert check_order(Grid(grid.times, samples, PERIOD_S)).fault is Fault.WRAPPED


@pytest.mark.parametrize(("per_m", "way"), [(-4.6, 1), (4.6, -1), (0.0, 0)])
def test_the_pole_tells_which_way_it_counts(per_m: float, way: int) -> None:
    """The linear equation of a hanging pole, ph'' = per_m (v' + g ph), is integrated here."""
    t, step = np.arange(0, 1.5, 1e-4), 1e-4
    speed = 0.1 * np.sin(8 * t) ** 2
    angle, rate, shown = 0.0, 0.0, []
    for k, faster in enumerate(np.gradient(speed, step)):
        if k % 100 == 0:
            shown.append(
                (
                    math.pi + round(angle / 1.5e-3) * 1.5e-3,
                    0.0,
                    float(np.sum(speed[:k]) * step),
                    0.0,
                )
            )
        rate += (per_m * faster - 4.6 * 9.81 * angle) * step
        angle += rate * step
    answer = measure_pole_answer(
        Grid(PERIOD_S * np.arange(len(shown)), np.array(shown), PERIOD_S), math.pi, 4.6
    )
    assert (answer.way, answer.stands) == (way, per_m == 0.0)
    assert answer.per_m == pytest.approx(per_m, abs=0.5)


def test_nothing_that_moves_fits_nothing() -> None:
    still = np.zeros(50)
    assert not fit_derivative(still, still, PERIOD_S).proportional

"""A rig at rest, recorded and spoilt: each fault gives its finding and no other."""

import math
import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.doctor_bench import TWIN, faults, lines

from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.listening import Listened
from pendulum_bridge.doctor.resting import compute_running_median
from pendulum_bridge.doctor.standing import CHECKS, check_standing
from pendulum_bridge.doctor.track import remove_spikes
from pendulum_bridge.doctor.wire import Heard
from pendulum_bridge.doctor.zeros import check_rail
from pendulum_bridge.wire.udp import Address
from pendulum_twin.model import Twin

RATE_HZ, COUNT = 100.0, 300
POLE, POLE_RATE, CART, CART_VELOCITY = range(4)
POLE_STEP, CART_STEP = math.tau / 4096, 57e-6
Spoil = Callable[[np.ndarray], np.ndarray]


def resting(angle_rad: float = math.pi, cart_m: float = 0.01, seed: int = 0) -> np.ndarray:
    """Return samples of a rig at rest whose encoders flicker between two steps."""
    flicker = np.random.default_rng(seed).integers(0, 2, (COUNT + 1, 2))
    positions = np.array([angle_rad, cart_m]) + flicker * [POLE_STEP, CART_STEP]
    speeds = np.diff(positions, axis=0) * RATE_HZ
    return np.stack([positions[1:, 0], speeds[:, 0], positions[1:, 1], speeds[:, 1]], axis=1)


def heard(samples: np.ndarray) -> Listened:
    return Listened(
        tuple(
            Heard(struct.pack(">dddd", *row), 0.01 * (k + 1))
            for k, row in enumerate(samples.tolist())
        )
    )


def findings(samples: np.ndarray, twin: Twin = TWIN) -> tuple[Finding, ...]:
    return check_standing(heard(samples), twin, RATE_HZ).findings


def changed(column: int, change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    def spoil(samples: np.ndarray) -> np.ndarray:
        spoilt = samples.copy()
        spoilt[:, column] = change(spoilt[:, column])
        return spoilt

    return spoil


def plus(column: int, value: float) -> Spoil:
    return changed(column, lambda values: values + value)


def spiky(samples: np.ndarray) -> np.ndarray:
    spoilt = samples.copy()
    spoilt[50::40, [POLE, CART]] += [1.0, 0.05]
    return spoilt


def thickly_spiky(samples: np.ndarray) -> np.ndarray:
    """Return samples with spikes so close that a running median does not remove all."""
    spoilt = samples.copy()
    spoilt[[50, 51, 53, 120, 122, 123], POLE] += 1.0
    return spoilt


def noisy(samples: np.ndarray) -> np.ndarray:
    return samples + np.random.default_rng(1).normal(0, [0.012, 0.0, 0.0, 0.0], samples.shape)


def wrapped(samples: np.ndarray) -> np.ndarray:
    return changed(
        POLE, lambda angle: np.where(np.arange(COUNT) % 3 == 0, angle - math.tau, angle)
    )(samples)


def swinging(samples: np.ndarray) -> np.ndarray:
    return changed(POLE, lambda angle: angle + 0.1 * np.sin(0.07 * np.arange(COUNT)))(samples)


def order(*columns: int) -> Spoil:
    return lambda samples: samples[:, columns]


SPOILT: list[tuple[str, Spoil, set[Fault]]] = [
    ("clean", lambda samples: samples, set()),
    ("cart and pole swapped", order(CART, CART_VELOCITY, POLE, POLE_RATE), {Fault.FIELDS_MIXED}),
    (
        "positions first, cart first",
        order(CART, POLE, CART_VELOCITY, POLE_RATE),
        {Fault.FIELDS_MIXED},
    ),
    ("rate before angle", order(POLE_RATE, POLE, CART, CART_VELOCITY), {Fault.FIELDS_MIXED}),
    ("the cart rolls", changed(CART, lambda cart: cart + 1e-4 * np.arange(COUNT)), {Fault.MOVING}),
    ("the pole swings", swinging, {Fault.MOVING}),
    ("noise", noisy, {Fault.NOISY}),
    ("spikes", spiky, {Fault.SPIKES}),
    ("spikes in heaps", thickly_spiky, {Fault.SPIKES}),
    ("a pole rate that is none", plus(POLE_RATE, 0.4), {Fault.VELOCITY_AT_REST}),
    ("a cart velocity that is none", plus(CART_VELOCITY, -0.05), {Fault.VELOCITY_AT_REST}),
    ("hanging reads 0", plus(POLE, -math.pi), {Fault.HANGS_AT_ZERO}),
    ("hanging reads nearly 0", plus(POLE, 0.1 - math.pi), {Fault.HANGS_AT_ZERO}),
    ("hanging reads -pi", plus(POLE, -math.tau), {Fault.TURNED}),
    ("hanging reads 3 pi", plus(POLE, math.tau), {Fault.TURNED}),
    ("degrees", changed(POLE, np.degrees), {Fault.DEGREES}),
    ("negative degrees", changed(POLE, lambda angle: -np.degrees(angle)), {Fault.DEGREES}),
    ("wrapped", wrapped, {Fault.WRAPPED}),
    ("an offset", plus(POLE, 0.1), {Fault.ZERO_OFF}),
    ("an offset after two turns", plus(POLE, -0.1 + 2 * math.tau), {Fault.ZERO_OFF}),
    ("a quarter turn", plus(POLE, math.pi / 2), {Fault.ZERO_WRONG}),
    ("beside the middle", plus(CART, -0.3), {Fault.OFF_MIDDLE}),
    ("beyond the rail", plus(CART, 1.0), {Fault.BEYOND_RAIL}),
    ("millimetres", changed(CART, lambda cart: 1e3 * cart), {Fault.MILLIMETRES}),
]


@pytest.mark.parametrize(
    ("spoil", "expected"), [case[1:] for case in SPOILT], ids=[case[0] for case in SPOILT]
)
def test_each_fault_gives_its_finding_and_no_other(spoil: Spoil, expected: set[Fault]) -> None:
    listed = findings(spoil(resting()))
    assert faults(listed) == expected, lines(listed)
    assert tuple(finding.check for finding in listed) == CHECKS
    for finding in listed:
        assert finding.observed and (finding.expected or finding.skipped)


def test_a_clean_rig_is_ok_in_every_line() -> None:
    listed = findings(resting())
    assert {finding.verdict for finding in listed} == {Verdict.OK}
    by_check = {finding.check: finding for finding in listed}
    assert (
        "steps of 0.0015 rad" in by_check[Check.NOISE].observed
        and "steps of 0.057 mm" in by_check[Check.NOISE].observed
    )
    assert by_check[Check.POLE_ZERO].line == (
        "OK       zero, pole             "
        "expected 3.142 rad while the pole hangs still; found 3.143 rad"
    )


@settings(deadline=None)
@given(st.floats(-0.02, 0.02), st.floats(-0.04, 0.04), st.integers(0, 999))
def test_wherever_it_rests_a_good_rig_is_good(angle_rad: float, cart_m: float, seed: int) -> None:
    assert not faults(findings(resting(math.pi + angle_rad, cart_m, seed)))


def test_what_hangs_on_rest_and_order_is_skipped_without_them() -> None:
    moving = findings(swinging(resting()))
    assert [finding.check for finding in moving if finding.verdict is Verdict.SKIPPED] == [
        Check.VELOCITIES, Check.POLE_ZERO, Check.CART_ZERO,
    ]  # fmt: skip
    mixed = findings(resting()[:, [CART, CART_VELOCITY, POLE, POLE_RATE]])
    assert mixed[-1].line == "SKIPPED  zero, cart             the fields are not in their order"
    assert "the place of the cart position" in mixed[2].observed


def test_the_offset_that_the_twin_file_states_is_expected() -> None:
    twin = replace(TWIN, effects={"angle_offset": {"angle_rad": 0.1}})
    assert not faults(findings(resting(math.pi + 0.1), twin))
    assert faults(findings(resting(), twin)) == {Fault.ZERO_OFF}


def test_a_twin_without_a_pole_is_not_asked_for_its_zero() -> None:
    keys = ("pole_mass_kg", "com_distance_m", "pole_inertia_kg_m2", "pole_viscous_n_m_s")
    twin = Twin("cart", replace(TWIN.rig, **dict.fromkeys(keys)))
    listed = findings(resting(0.0), twin)
    assert not faults(listed)
    assert [finding.check for finding in listed if finding.verdict is Verdict.SKIPPED] == [
        Check.FIELDS,
        Check.POLE_ZERO,
    ]


@pytest.mark.parametrize(
    ("listened", "fault", "words"),
    [
        (Listened(()), Fault.SILENT, "nothing"),
        (
            Listened((), 12, Address("10.0.0.7", 5)),
            Fault.ALL_FOREIGN,
            "12 packets of another host (10.0.0.7), none of the rig",
        ),
        (Listened((), trouble="refused."), Fault.NOT_CONNECTED, "no connection: refused"),
        (
            replace(heard(resting()), foreign=3, stranger=Address("10.0.0.7", 5)),
            Fault.SOME_FOREIGN,
            "300 packets, and 3 packets",
        ),
        (
            replace(heard(resting()), silent_s=1.2),
            Fault.FELL_SILENT,
            "300 packets, then nothing for 1.2 s",
        ),
    ],
)
def test_who_is_heard(listened: Listened, fault: Fault, words: str) -> None:
    stood = check_standing(listened, TWIN, RATE_HZ)
    assert faults(stood.findings) == {fault}
    assert words in stood.findings[0].observed
    assert tuple(finding.check for finding in stood.findings) == CHECKS
    assert (stood.rest_state is None) == (not listened.heard)


def test_packets_that_hold_nothing_leave_nothing_to_look_at() -> None:
    packets = tuple(
        Heard(struct.pack("<dddd", *row), 0.01 * k) for k, row in enumerate(resting().tolist())
    )
    stood = check_standing(Listened(packets), TWIN, RATE_HZ)
    assert faults(stood.findings) == {Fault.BYTES_SWAPPED}
    assert tuple(finding.check for finding in stood.findings) == CHECKS
    assert {finding.verdict for finding in stood.findings[2:]} == {Verdict.SKIPPED}


def test_the_rail_is_as_long_as_the_positions_say() -> None:
    assert check_rail(-0.5, 0.8, 0.9).fault is None
    assert check_rail(-0.95, 0.1, 0.9).fault is Fault.BEYOND_RAIL
    assert check_rail(0.0, 0.0, None).verdict is Verdict.SKIPPED


def test_the_running_median_takes_spikes_away_and_nothing_else() -> None:
    ramp = np.arange(20.0)
    spiky_ramp = ramp.copy()
    spiky_ramp[[4, 11, 12]] += 100
    assert compute_running_median(ramp)[2:-2].tolist() == ramp[2:-2].tolist()
    assert np.abs(compute_running_median(spiky_ramp) - ramp).max() <= 2


def test_spikes_are_taken_away_and_single_counts_of_a_slow_rate_are_not() -> None:
    counts = np.tile([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0], 10)
    spoilt = counts.copy()
    spoilt[[20, 50, 51]] += 100
    assert not np.any(compute_running_median(counts))
    assert remove_spikes(counts[:, None])[:, 0].tolist() == counts.tolist()
    assert np.abs(remove_spikes(spoilt[:, None])[:, 0] - counts).max() <= 1

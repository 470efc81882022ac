"""Bytes that are no samples are named by the mistake that makes them."""

import math
import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.packets import check_packets, unpack_samples
from pendulum_bridge.wire.protocol import Sample

GOOD = Sample(
    math.pi, 0.01, -0.002, 1e-100
).pack()  # a velocity that dies out is as small as a swapped number looks


def test_samples_are_samples() -> None:
    finding = check_packets([GOOD] * 9)
    assert (finding.verdict, finding.observed) == (Verdict.OK, "that in all 9 packets")


@pytest.mark.parametrize(
    ("packet", "fault", "words"),
    [
        (
            struct.pack("<dddd", math.pi, 0.01, -0.002, 0.0),
            Fault.BYTES_SWAPPED,
            "little-endian doubles (angle 3.142)",
        ),
        (struct.pack("<dddd", math.pi, 0.0, 0.0, 0.0), Fault.BYTES_SWAPPED, "little-endian"),
        (
            struct.pack(">ffff", math.pi, 0.0, 0.0, 0.0),
            Fault.WRONG_LENGTH,
            "16 bytes (a command, perhaps our own, or four floats",
        ),
        (struct.pack(">ddd", math.pi, 0.0, 0.0), Fault.WRONG_LENGTH, "24 bytes (3 doubles?)"),
        (b"3.14, 0, 0, 0", Fault.WRONG_LENGTH, "13 bytes of text ('3.14, 0, 0, 0')"),
        (b"", Fault.WRONG_LENGTH, "0 bytes"),
        (bytes(64), Fault.WRONG_LENGTH, "64 bytes or more"),
        (struct.pack(">dddd", math.nan, 0.0, 0.0, 0.0), Fault.NOT_FINITE, "NaN or infinity"),
        (struct.pack(">dddd", math.pi, 0.0, 0.0, math.inf), Fault.NOT_FINITE, "NaN or infinity"),
    ],
)
def test_each_mistake_is_named(packet: bytes, fault: Fault, words: str) -> None:
    finding = check_packets([packet] * 6 + [GOOD])
    assert finding.fault is fault
    assert words in finding.observed and finding.observed.endswith("in 6 of 7 packets")
    stray = check_packets([packet] + [GOOD] * 9)
    assert stray.fault is Fault.SOME_MALFORMED and words in stray.observed


@given(
    st.integers(-9, 9),
    st.floats(-0.29, 0.29),
    st.integers(-15000, 15000),
    st.floats(-20, 20),
    st.floats(-2, 2),
)
def test_no_hanging_rig_is_taken_for_swapped(
    turns: int, angle: float, cart: int, rate: float, velocity: float
) -> None:
    sample = Sample((2 * turns + 1) * math.pi + angle, rate, 57e-6 * cart, velocity)
    assert check_packets([sample.pack()]).fault is None


@example(7, 0)  # as believable straight
@given(st.integers(-100, 100), st.integers(-15000, 15000))
def test_swapped_samples_are_recognised_wherever_the_rig_hangs(
    angle_counts: int, cart_counts: int
) -> None:
    """Some of these angles are believable straight as well, 7 counts from hanging for one."""
    swapped = struct.pack(
        "<dddd", math.pi + angle_counts * math.tau / 4096, 0.0, 57e-6 * cart_counts, 0.0
    )
    assert check_packets([swapped]).fault is Fault.BYTES_SWAPPED


def test_only_samples_are_handed_on() -> None:
    assert unpack_samples([GOOD, b"", GOOD[:-1]]) == [Sample.unpack(GOOD), None, None]

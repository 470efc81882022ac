"""The wire protocol: known bytes, every number there and back, and what is refused."""

import math
import re
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError

numbers = st.floats(allow_nan=False, allow_infinity=False)
samples = st.builds(Sample, numbers, numbers, numbers, numbers)
commands = st.builds(Command, numbers, st.booleans())
ONE, TWO, HALF = (
    bytes.fromhex("3ff0000000000000"),
    bytes.fromhex("4000000000000000"),
    bytes.fromhex("3fe0000000000000"),
)


def test_known_bytes() -> None:
    assert Command(0.5, True).pack() == HALF + ONE
    assert Command(-0.0).pack() == bytes.fromhex("8000000000000000") + bytes(8)
    assert Sample(
        pole_rad=1.0, pole_rate=2.0, cart_m=0.5, cart_velocity=0.0
    ).pack() == ONE + TWO + HALF + bytes(8)
    assert Sample.unpack(ONE + TWO + HALF + bytes(8)) == Sample(1.0, 2.0, 0.5, 0.0)


@given(commands)
def test_commands_there_and_back(command: Command) -> None:
    assert Command.unpack(command.pack()) == command
    assert command.pack() == struct.pack(">dd", command.pwm, command.reset)


@given(samples)
def test_samples_there_and_back(sample: Sample) -> None:
    assert Sample.unpack(sample.pack()).pack() == sample.pack()
    assert Sample.unpack(sample.pack()) == sample


def pack_command(pwm: bytes, flag: float) -> bytes:
    return pwm + struct.pack(">d", flag)


LIKELY = st.one_of(
    st.binary(max_size=80),
    st.binary(min_size=32, max_size=32),
    st.builds(pack_command, st.binary(min_size=8, max_size=8), st.sampled_from([0.0, -0.0, 1.0])),
)


@given(LIKELY)
def test_any_bytes_are_a_packet_or_refused_in_a_sentence(packet: bytes) -> None:
    for kind in (Command, Sample):
        try:
            unpacked = kind.unpack(packet)
        except BadInputError as error:
            assert re.match("(command|sample): expected ", str(error))
            continue
        minus_0 = kind is Command and packet[8:] == struct.pack(">d", -0.0)  # a flag of 0, too
        assert unpacked.pack() == (packet[:8] + bytes(8) if minus_0 else packet)


@pytest.mark.parametrize("flag", [0.0, -0.0, 1.0])
def test_every_flag_of_the_protocol_is_read(flag: float) -> None:
    assert Command.unpack(struct.pack(">dd", 0.25, flag)) == Command(0.25, flag == 1.0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused(bad: float) -> None:
    for make in (
        lambda: Command(bad),
        lambda: Command.unpack(struct.pack(">dd", bad, 0)),
        lambda: Command.unpack(struct.pack(">dd", 0, bad)),
        lambda: Sample(0.0, 0.0, bad, 0.0),
        lambda: Sample.unpack(struct.pack(">dddd", 0, 0, 0, bad)),
    ):
        with pytest.raises(BadInputError, match=f"expected finite numbers, found {bad}"):
            make()


def test_a_wrong_length_or_flag_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"^command: expected a packet of 16 bytes, found 15$"):
        Command.unpack(bytes(15))
    with pytest.raises(BadInputError, match=r"^sample: expected a packet of 32 bytes, found 0$"):
        Sample.unpack(b"")
    with pytest.raises(
        BadInputError, match=r"^command: expected the reset flag to be 0 or 1, found 0.5$"
    ):
        Command.unpack(struct.pack(">dd", 0.0, 0.5))

"""Check that packets hold samples of the protocol, and name the mistake when they do not."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Sequence

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.wire.protocol import SAMPLE, Sample
from pendulum_bridge.wire.udp import LONGEST_PACKET
from pendulum_twin.errors import BadInputError

SWAPPED = struct.Struct("<dddd")
# Indices of the positions. A velocity that dies out may be as small as a swapped number looks.
POSITIONS = (0, 2)
HANGING_RAD = 0.3
LEAST, MOST = 1e-9, 1e6  # m, rad: size of a position that is not 0
EXPECTED = f"{SAMPLE.size} bytes, four big-endian doubles (>dddd)"


def unpack_samples(packets: Sequence[bytes]) -> list[Sample | None]:
    """Return the sample of each packet; None for a packet that holds no sample."""
    return [_unpack_sample(packet) for packet in packets]


def check_packets(packets: Sequence[bytes]) -> Finding:
    """Return whether the packets hold samples; wrong packets in the minority are strays."""
    mistakes = Counter(
        mistake for packet in packets if (mistake := _find_mistake(packet)) is not None
    )
    right, total = len(packets) - mistakes.total(), len(packets)
    if not mistakes:
        return Finding(Check.PACKETS, EXPECTED, f"that in all {total} packets")
    (fault, what), count = mistakes.most_common(1)[0]
    if 2 * right >= total:
        fault = Fault.SOME_MALFORMED
    return Finding(Check.PACKETS, EXPECTED, f"{what} in {count} of {total} packets", fault)


def _find_mistake(packet: bytes) -> tuple[Fault, str] | None:
    if len(packet) != SAMPLE.size:
        return Fault.WRONG_LENGTH, _describe_packet(packet)
    straight, swapped = SAMPLE.unpack(packet), SWAPPED.unpack(packet)
    if _is_believable(swapped) and (
        not _is_believable(straight) or (_is_hanging(swapped) and not _is_hanging(straight))
    ):
        return Fault.BYTES_SWAPPED, f"little-endian doubles (angle {swapped[0]:.3f})"
    return None if all(map(math.isfinite, straight)) else (Fault.NOT_FINITE, "NaN or infinity")


def _is_believable(fields: tuple[float, ...]) -> bool:
    return all(fields[k] == 0 or LEAST <= abs(fields[k]) <= MOST for k in POSITIONS) and all(
        map(math.isfinite, fields)
    )


def _is_hanging(fields: tuple[float, ...]) -> bool:
    """Return whether the angle is near hanging, where few numbers are when bytes are swapped."""
    return abs(math.remainder(fields[0] - math.pi, math.tau)) < HANGING_RAD


def _describe_packet(packet: bytes) -> str:
    """Return what a packet of a wrong length may hold."""
    size = (
        f"{len(packet)} bytes"
        if len(packet) < LONGEST_PACKET
        else f"{LONGEST_PACKET} bytes or more"
    )
    if packet and packet.isascii() and packet.decode().strip().isprintable():
        return f"{size} of text ({packet.decode().strip()[:20]!r})"
    if len(packet) == 16:
        return f"{size} (a command, perhaps our own, or four floats: mask >ffff)"
    return f"{size} ({len(packet) // 8} doubles?)" if packet and len(packet) % 8 == 0 else size


def _unpack_sample(packet: bytes) -> Sample | None:
    try:
        return Sample.unpack(packet)
    except BadInputError:
        return None

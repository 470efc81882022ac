"""Turn the messages of the two topics into arrays; how a message is decoded is passed in."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pendulum_sysid.reading.raw import JOINTS, STATE_CHANNELS
from pendulum_sysid.reading.stamp_order import find_ordered
from pendulum_twin.arrays import Floats, Ints

Decode = Callable[[bytes], Any]
Messages = Iterable[tuple[int, bytes]]


@dataclass(frozen=True)
class DecodedStates:
    """Hold the joint states of (n,) messages that are used.

    stamps_ns: (n,) of their headers; they rise, unless the clock was set back.
    received_ns: (n,) when they were received.
    channels: channel -> (n,) values; joints are found by name, NaN where a message lacks one.
    unused: number of messages that could not be decoded, or were out of order.
    """

    stamps_ns: Ints
    received_ns: Ints
    channels: dict[str, Floats]
    unused: int


def decode_states(messages: Messages, decode: Decode) -> DecodedStates:
    """Return the joint states of all messages that can be decoded and are in order."""
    decoded, times, bad = _decoded(messages, decode)
    stamps = np.array(
        [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in decoded], dtype=np.int64
    )
    rows = [
        [
            _pick_joint(m.name, values, joint)
            for values in (m.position, m.velocity)
            for joint in JOINTS
        ]
        for m in decoded
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, len(STATE_CHANNELS)).T
    received = np.array(times, dtype=np.int64)
    ordered = find_ordered(stamps) & find_ordered(received)
    channels = dict(zip(STATE_CHANNELS, table[:, ordered], strict=True))
    present = {name: values for name, values in channels.items() if not np.all(np.isnan(values))}
    unused = bad + int(np.count_nonzero(~ordered))
    return DecodedStates(stamps[ordered], received[ordered], present, unused)


def decode_commands(messages: Messages, decode: Decode) -> tuple[Ints, Floats, int]:
    """Return receive times (ns), values, and the number of undecodable messages."""
    decoded, times, bad = _decoded(messages, decode)
    return (
        np.array(times, dtype=np.int64),
        np.array([m.data for m in decoded], dtype=np.float64),
        bad,
    )


def list_joint_names(messages: Messages, decode: Decode) -> str:
    """Return the joints that the first message which can be decoded names, in words."""
    decoded, _, _ = _decoded(messages, decode)
    if not decoded:
        return "no message that can be decoded"
    return ", ".join(decoded[0].name) or "messages without names"


def _decoded(messages: Messages, decode: Decode) -> tuple[list[Any], list[int], int]:
    decoded, times, bad = [], [], 0
    for time, data in messages:
        try:
            decoded.append(decode(data))
        except Exception:  # damaged bytes break a decoder in any way
            bad += 1
        else:
            times.append(time)
    return decoded, times, bad


def _pick_joint(names: list[str], values: Floats, joint: str) -> float:
    place = names.index(joint) if joint in names else len(values)
    return float(values[place]) if place < len(values) else np.nan

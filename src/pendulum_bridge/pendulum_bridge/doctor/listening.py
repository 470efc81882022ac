"""Listen to the rig for a while, and check that it is the rig that sends."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.wire import Heard, Wire
from pendulum_bridge.wire.udp import Address

LONGEST_FIRST_S = 2.0  # until the first packet
LONGEST_SILENCE_S = 0.5  # at the end; after a longer silence the rig has stopped


@dataclass(frozen=True)
class Listened:
    """Hold what was heard.

    heard: packets of the rig's host.
    foreign: number of packets of other hosts.
    stranger: who sent the last foreign packet.
    silent_s: from the last packet to the end.
    trouble: why the rig is not connected; empty when it is.
    """

    heard: tuple[Heard, ...]
    foreign: int = 0
    stranger: Address | None = None
    silent_s: float = 0.0
    trouble: str = ""


def listen(wire: Wire, seconds: float) -> Listened:
    """Listen for so many seconds from the first packet on.

    Gives up when no packet comes within LONGEST_FIRST_S.
    """
    heard: list[Heard] = []
    end = wire.now() + LONGEST_FIRST_S
    while (now := wire.now()) < end:
        packet = wire.receive(end)
        if packet is not None:
            end = end if heard else now + seconds
            heard.append(packet)
    silent_s = wire.now() - heard[-1].at_s if heard else LONGEST_FIRST_S
    return Listened(tuple(heard), wire.foreign, wire.stranger, silent_s, wire.trouble)


def check_samples(listened: Listened) -> Finding:
    """Return whether packets come from the rig, and from no other host."""
    expected = f"a first packet of the rig within {LONGEST_FIRST_S:g} s, and no others"
    count, strangers = len(listened.heard), f"{listened.foreign} packets of another host"
    if listened.stranger is not None:
        strangers += f" ({listened.stranger.host})"
    if not count and listened.trouble:
        return Finding(
            Check.SAMPLES,
            expected,
            f"no connection: {listened.trouble.rstrip('.')}",
            Fault.NOT_CONNECTED,
        )
    if not count:
        observed, fault = (
            (strangers, Fault.ALL_FOREIGN) if listened.foreign else ("nothing", Fault.SILENT)
        )
        return Finding(
            Check.SAMPLES,
            expected,
            f"{observed}, none of the rig" if listened.foreign else observed,
            fault,
        )
    if listened.silent_s > LONGEST_SILENCE_S:
        observed = f"{count} packets, then nothing for {listened.silent_s:.1f} s"
        return Finding(Check.SAMPLES, expected, observed, Fault.FELL_SILENT)
    if listened.foreign:
        return Finding(
            Check.SAMPLES, expected, f"{count} packets, and {strangers}", Fault.SOME_FOREIGN
        )
    return Finding(Check.SAMPLES, expected, f"{count} packets of the rig")

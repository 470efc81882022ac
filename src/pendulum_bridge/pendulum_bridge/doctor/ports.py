"""Check the addresses: hosts known, networks that meet, our port free, a listener at the rig."""

from __future__ import annotations

import errno
import ipaddress
import select
import socket

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.port_owner import find_owner
from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.udp import Address, resolve_host
from pendulum_twin.errors import BadInputError

REFUSAL_S = 0.2  # in which a machine in the same network refuses a packet


def check_address(listen: Address | None, rig: Address) -> Finding:
    """Return whether the rig's host is known, and can send to our address.

    listen: our address; None over TCP, where we connect to the rig.
    """
    expected = "a host that this machine knows, in a network that it is in"
    try:
        number = resolve_host(rig)
    except BadInputError:
        return Finding(
            Check.ADDRESS, expected, f"{rig.host!r}, which nobody knows", Fault.HOST_UNKNOWN
        )
    loopback = ipaddress.ip_address(number).is_loopback
    observed = f"{number}, {'this machine itself (loopback)' if loopback else 'another machine'}"
    if listen is not None and not _can_reach(listen, loopback):
        return Finding(
            Check.ADDRESS,
            expected,
            f"{observed}, while we listen on {listen}",
            Fault.LOOPBACK_MIXED,
        )
    return Finding(Check.ADDRESS, expected, observed)


def _can_reach(listen: Address, loopback: bool) -> bool:
    """Return whether a rig, on the loopback network or not, can reach our address."""
    try:
        here = ipaddress.ip_address(resolve_host(listen))
    except BadInputError:
        return True  # the check of our port tells about the address itself
    return here.is_unspecified or here.is_loopback == loopback


def report_port_open(listen: Address) -> Finding:
    """Return the finding for an address that is free to listen on."""
    return Finding(Check.OUR_PORT, f"{listen} free to listen on", "it is")


def report_port_refused(listen: Address, error: BadInputError) -> Finding:
    """Return the finding for an address that is taken, and by whom, or that is not ours."""
    expected = f"{listen} free to listen on"
    number = error.__cause__.errno if isinstance(error.__cause__, OSError) else None
    if number == errno.EADDRINUSE:
        return Finding(
            Check.OUR_PORT, expected, f"it is taken by {find_owner(listen.port)}", Fault.PORT_TAKEN
        )
    return Finding(Check.OUR_PORT, expected, str(error).split(";")[0], Fault.PORT_REFUSED)


def check_rig_port(rig: Address) -> Finding:
    """Return whether packets to the rig's address are refused; it is sent PWM 0.

    Only a refusal is certain: a firewall may drop packets silently.
    """
    expected = f"somebody to listen on {rig}"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((resolve_host(rig), rig.port))
            probe.send(Command(0.0).pack())
            if select.select([probe], [], [], REFUSAL_S)[0]:
                probe.recv(1)
        except ConnectionRefusedError:
            return Finding(
                Check.RIG_PORT, expected, "nobody: packets are refused", Fault.NOBODY_LISTENS
            )
        except OSError as error:
            return Finding(
                Check.RIG_PORT, expected, f"no way there: {error.strerror}", Fault.NOBODY_LISTENS
            )
    return Finding(Check.RIG_PORT, expected, "packets are not refused")

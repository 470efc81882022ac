"""Addresses that cannot work are named, with the program that uses a port."""

import os
from pathlib import Path

import pytest
from support.running_emulator import free_ports, udp_socket

from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.port_owner import UNKNOWN_OWNER, find_owner
from pendulum_bridge.doctor.ports import check_address, check_rig_port, report_port_refused
from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.udp import Address, Endpoint
from pendulum_twin.errors import BadInputError

LOOPBACK, ALL, ELSEWHERE = (
    Address("127.0.0.1", 1),
    Address("0.0.0.0", 1),
    Address("192.168.7.9", 1),
)


@pytest.mark.parametrize(
    ("listen", "rig", "fault"),
    [
        (LOOPBACK, LOOPBACK, None),
        (LOOPBACK, Address("localhost", 1), None),
        (ALL, LOOPBACK, None),
        (ALL, ELSEWHERE, None),
        (Address("192.168.7.1", 1), ELSEWHERE, None),
        (None, ELSEWHERE, None),
        (LOOPBACK, ELSEWHERE, Fault.LOOPBACK_MIXED),
        (ELSEWHERE, LOOPBACK, Fault.LOOPBACK_MIXED),
        (LOOPBACK, Address("no such host", 1), Fault.HOST_UNKNOWN),
    ],
)
def test_both_ends_have_to_meet(listen: Address | None, rig: Address, fault: Fault | None) -> None:
    finding = check_address(listen, rig)
    assert finding.fault is fault
    assert ("loopback" in finding.observed) == (rig in (LOOPBACK, Address("localhost", 1)))


def refusal(listen: Address) -> BadInputError:
    with pytest.raises(BadInputError) as caught:
        Endpoint(listen, LOOPBACK, bytes).close()
    return caught.value


def test_who_has_the_port_is_named() -> None:
    with udp_socket() as other:
        other.bind(("127.0.0.1", 0))
        listen = Address(*other.getsockname())
        finding = report_port_refused(listen, refusal(listen))
        assert finding.fault is Fault.PORT_TAKEN and "driver_node" in finding.advice
        assert finding.observed.endswith(f"(process {os.getpid()})")


def test_an_address_of_another_machine_cannot_be_listened_on() -> None:
    finding = report_port_refused(ELSEWHERE, refusal(ELSEWHERE))
    assert (
        finding.fault is Fault.PORT_REFUSED
        and "cannot listen on 192.168.7.9:1" in finding.observed
    )


def test_a_rig_that_listens_gets_pwm_0_and_one_that_does_not_is_known() -> None:
    (port,) = free_ports(1)
    assert check_rig_port(Address("127.0.0.1", port)).fault is Fault.NOBODY_LISTENS
    with udp_socket() as rig:
        rig.bind(("127.0.0.1", port))
        rig.settimeout(5.0)
        assert check_rig_port(Address("127.0.0.1", port)).verdict is Verdict.OK
        assert rig.recv(100) == Command(0.0).pack()


def proc(folder: Path, command: str, port: int = 16385) -> Path:
    """Make what Linux shows of one program with one UDP port."""
    (folder / "net").mkdir(parents=True)
    row = (
        f" 12: 0100007F:{port:04X} 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000"
        "        0 777 2 0 0"
    )
    (folder / "net" / "udp").write_text(f"  sl  local_address rem_address   st ...\n{row}\n")
    (folder / "42" / "fd").mkdir(parents=True)
    (folder / "42" / "fd" / "3").symlink_to("socket:[777]")
    (folder / "42" / "cmdline").write_text(command)
    (folder / "7").mkdir()  # somebody else's, of which nothing is shown
    return folder


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("/usr/bin/python3\0-u\0/opt/bin/driver_node\0--ros-args\0", "driver_node"),
        (
            "python3.12\0-m\0pendulum_bridge.nodes.driver_node\0",
            "pendulum_bridge.nodes.driver_node",
        ),
        ("/usr/bin/rigd\0-x\0", "rigd"),
        ("", UNKNOWN_OWNER),
    ],
)
def test_a_program_is_named_as_its_user_knows_it(tmp_path: Path, command: str, name: str) -> None:
    assert find_owner(16385, proc(tmp_path, command)) == f"{name} (process 42)"


def test_an_owner_that_is_not_shown_is_another_program(tmp_path: Path) -> None:
    assert find_owner(16386, proc(tmp_path, "x")) == UNKNOWN_OWNER
    assert find_owner(16385, tmp_path / "none") == UNKNOWN_OWNER

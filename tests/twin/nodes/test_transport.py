"""Programs speak UDP alone: none of them holds a lock that outlives another."""

from pathlib import Path

import pytest

rclpy = pytest.importorskip("rclpy")
from support.real_time_user import TWIN  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_twin import topics  # noqa: E402
from pendulum_twin.nodes.transport import (  # noqa: E402
    LOOPBACK,
    MIDDLEWARE,
    PEERS,
    PROFILES,
    RANGE,
    TRANSPORTS,
    leave_shared_memory,
)

SHARED_MEMORY = "/dev/shm/fastrtps"


@pytest.mark.parametrize(
    ("given", "chosen"),
    [
        ({}, {TRANSPORTS: "UDPv4"}),
        ({RANGE: "SUBNET"}, {RANGE: "SUBNET", TRANSPORTS: "UDPv4"}),
        ({RANGE: "LOCALHOST"}, {RANGE: "SYSTEM_DEFAULT", PROFILES: LOOPBACK}),
        ({TRANSPORTS: "LARGE_DATA"}, {TRANSPORTS: "LARGE_DATA"}),
        ({PROFILES: "mine.xml"}, {PROFILES: "mine.xml"}),
        ({RANGE: "LOCALHOST", PROFILES: "mine.xml"}, {RANGE: "LOCALHOST", PROFILES: "mine.xml"}),
        (
            {RANGE: "LOCALHOST", PEERS: "192.0.2.1"},
            {RANGE: "LOCALHOST", PEERS: "192.0.2.1"},
        ),
        (
            {PEERS: "192.0.2.1", MIDDLEWARE: ""},
            {PEERS: "192.0.2.1", MIDDLEWARE: "", TRANSPORTS: "UDPv4"},
        ),
        (
            {RANGE: "LOCALHOST", MIDDLEWARE: "rmw_cyclonedds_cpp"},
            {RANGE: "LOCALHOST", MIDDLEWARE: "rmw_cyclonedds_cpp"},
        ),
        (
            {RANGE: "LOCALHOST", PROFILES: LOOPBACK},  # a second graph of the same process
            {RANGE: "SYSTEM_DEFAULT", PROFILES: LOOPBACK},
        ),
    ],
)
def test_the_choice_of_a_user_stands(given: dict[str, str], chosen: dict[str, str]) -> None:
    for _ in range(2):
        leave_shared_memory(given)
        assert given == chosen


def test_a_program_holds_no_shared_memory_and_others_hear_it(
    ros: Graph, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(PROFILES)
    monkeypatch.setenv(RANGE, "LOCALHOST")
    twin = ros.start("pendulum_twin.nodes.twin_node", "--ros-args", "-p", f"twin:={TWIN}")
    # a program that leaves the transports to the middleware
    plain = ros.start("support.hears", topics.JOINT_STATES)
    assert plain.stdout.readline() == "heard\n"
    assert SHARED_MEMORY in read_maps(plain.pid)
    assert SHARED_MEMORY not in read_maps(twin.pid)


def read_maps(process: int) -> str:
    """Return what a process has mapped."""
    return Path(f"/proc/{process}/maps").read_text(encoding="utf-8")

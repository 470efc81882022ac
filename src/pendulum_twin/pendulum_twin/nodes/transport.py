"""Speak UDP with other programs: a program that is killed leaves locks in shared memory."""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from pathlib import Path

RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
CHOICES = (TRANSPORTS, PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE", "ROS_STATIC_PEERS")
LOOPBACK = str(Path(__file__).with_name("loopback.xml"))
UDP = "UDPv4"


def leave_shared_memory(environment: MutableMapping[str, str] = os.environ) -> None:
    """Have Fast DDS speak UDP alone, unless the user has chosen transports or peers.

    environment: of this process, before its first `rclpy.init`; of a program that starts.

    The shared memory of Fast DDS 2.14 holds locks between processes. Who is killed while it holds
    a lock leaves it locked, and every program that publishes to the same port then waits without
    an end (`docs/faults.md` has the measurement). Other middleware ignores these variables.

    In the range LOCALHOST the middleware adds shared memory whatever the variables say. The range
    SYSTEM_DEFAULT leaves the choice to a profile: `loopback.xml` speaks on the loopback interface
    alone, as LOCALHOST does.
    """
    if any(environment.get(name, "") not in ("", LOOPBACK, UDP) for name in CHOICES):
        return
    if environment.get(RANGE) == "LOCALHOST":
        environment[RANGE] = "SYSTEM_DEFAULT"
        environment[PROFILES] = LOOPBACK
    elif not environment.get(PROFILES):
        environment[TRANSPORTS] = UDP

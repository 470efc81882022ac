"""Speak UDP with other programs: a program that is killed leaves locks in shared memory."""

from __future__ import annotations

import os
from collections.abc import MutableMapping
from pathlib import Path

MIDDLEWARE = "RMW_IMPLEMENTATION"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
PEERS = "ROS_STATIC_PEERS"
TRANSPORTS = "FASTDDS_BUILTIN_TRANSPORTS"
PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
LOOPBACK = str(Path(__file__).with_name("loopback.xml"))
UDP = "UDPv4"


def leave_shared_memory(environment: MutableMapping[str, str] = os.environ) -> None:
    """Have Fast DDS speak UDP alone, unless the user has chosen its transports.

    environment: of this process, before its first `rclpy.init`; of a program that starts. Nothing
        changes where it names another middleware.

    The shared memory of Fast DDS 2.14 holds locks between processes. Who is killed while it holds
    a lock leaves it locked, and every program that publishes to the same port then waits without
    an end (`docs/faults.md` has the measurement).

    In the range LOCALHOST the middleware adds shared memory whatever the variables say. The range
    SYSTEM_DEFAULT leaves the choice to a profile: `loopback.xml` speaks on the loopback interface
    alone, as LOCALHOST does. It knows no peers elsewhere, so LOCALHOST stays where there are some.
    """
    chosen = (environment.get(name, "") for name in (TRANSPORTS, PROFILES))
    other = "fastrtps" not in (environment.get(MIDDLEWARE) or "fastrtps")
    if other or any(name not in ("", LOOPBACK, UDP) for name in chosen):
        return
    if environment.get(RANGE) != "LOCALHOST":
        if not environment.get(PROFILES):
            environment[TRANSPORTS] = UDP
    elif not environment.get(PEERS):
        environment[RANGE] = "SYSTEM_DEFAULT"
        environment[PROFILES] = LOOPBACK

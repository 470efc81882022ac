"""A ROS graph with an emulated rig: rig and driver, a recorder, and a plan that is played."""

from __future__ import annotations

import secrets
import socket
from pathlib import Path

from pendulum_bridge.studies.programs import Program, Programs, wait_for, wait_until_done
from pendulum_bridge.wire.udp import Address
from pendulum_twin.errors import RigError, WorkerError

STATES_TOPIC = "/rig/joint_states"
# The command after the driver's limits (magnitude and rate of change): what the rig received.
APPLIED_TOPIC = "/rig/applied_pwm"
LOOPBACK = "127.0.0.1"
LONGEST_START_S = 180.0  # a program that takes longer to start is stuck, on any machine
LONGEST_PLAY_S = 300.0  # the plan lasts a minute; a busy machine takes longer to start and end it
# low ROS domains are what people choose; higher ones need ports that the system gives to others
DOMAIN_IDS = range(20, 100)


class PlanGivenUpError(RigError):
    """The excitation ended before its plan: a busy computer drives a rig late."""


def make_environment() -> dict[str, str]:
    """Return the variables of a ROS graph apart from all others, with plain logs."""
    return {
        "ROS_DOMAIN_ID": str(secrets.choice(DOMAIN_IDS)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}",
    }


def start_rig(programs: Programs, twin: Path, *options: object) -> Program:
    """Start the emulated rig and its driver on free ports; return the rig when both run.

    twin: file of the twin that emulator and driver get.
    options: further words of the emulator's command line.
    """
    rig, user = (Address(LOOPBACK, port) for port in _find_free_ports())
    emulator = programs.start(
        "rig_emulator", "--twin", twin, "--listen", rig, "--send", user, *options
    )
    wait_for(emulator, "listens on", LONGEST_START_S)
    ports = {"rig_port": rig.port, "listen_port": user.port}
    settings = {"twin": twin, "emulated": "true", **ports}
    driver = programs.start("driver_node", *list_node_arguments("/rig", **settings))
    wait_for(driver, "drives", LONGEST_START_S)
    return emulator


def start_recorder(programs: Programs, out: Path, twin: Path, note: str) -> Program:
    """Start the recorder; return it when it hears the rig.

    out: folder of the recording.
    twin: file of the twin that is kept with the recording.
    note: a remark that is kept, too.
    """
    settings = {"out": out, "twin": twin, "note": note}
    recorder = programs.start("recorder_node", *list_node_arguments("/", **settings))
    wait_for(recorder, f"hears {STATES_TOPIC}", LONGEST_START_S)
    return recorder


def play_plan(programs: Programs, **settings: object) -> None:
    """Play the plan to the rig; the excitation node prints its progress to the terminal.

    settings: parameters of the node. Unless they say otherwise, the rig is reset only where its
        cart has rolled off on a tilted rail, while the programs started: otherwise the emulated
        rig hangs at rest, and a driver cannot reset a rig whose signs are concealed.

    Raises PlanGivenUpError when the node gives up, WorkerError when another program fails.
    """
    usual = {"reset_first": "false", "reset_when_away": "true", "emulated": "true"}
    arguments = list_node_arguments("/excitation", **{**usual, **settings})
    excitation = programs.start("excitation_node", *arguments, to_terminal=True)
    try:
        wait_until_done(excitation, programs, LONGEST_PLAY_S)
    except WorkerError as error:
        if excitation.process.poll():
            raise PlanGivenUpError(str(error)) from error
        raise


def list_node_arguments(namespace: str, **parameters: object) -> list[str]:
    """Return the command line of a node; an empty text is written as YAML writes it."""
    arguments = ["--ros-args", "-r", f"__ns:={namespace}"]
    for name, value in parameters.items():
        arguments += ["-p", f"{name}:={"''" if value == '' else value}"]
    return arguments


def _find_free_ports() -> list[int]:
    """Return two UDP ports that are free now, so that the graph meets no other rig."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second,
    ):
        for port in (first, second):
            port.bind((LOOPBACK, 0))
        return [first.getsockname()[1], second.getsockname()[1]]

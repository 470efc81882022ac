"""Serve an emulated rig over a port, at its own pace or one sample for each command."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from pendulum_bridge.emulator.live_rig import LiveRig
from pendulum_bridge.emulator.schedule import Schedule
from pendulum_bridge.wire.port import Port
from pendulum_bridge.wire.protocol import Command
from pendulum_twin.standstill import NAMED_S, describe_standstill

LONGEST_WAIT_S = 0.1  # until the end is seen when no command comes
Ended = Callable[[], bool]


@dataclass(frozen=True)
class Served:
    """Count the samples sent and the commands taken.

    given_up_s: how far the samples fell behind their times.
    """

    samples: int
    commands: int
    given_up_s: float = 0.0


def serve_in_time(
    rig: LiveRig,
    port: Port[Command],
    speed: float,
    ended: Ended,
    tell: Callable[[str], None] = lambda sentence: None,
    at_once: bool = False,
) -> Served:
    """Send a sample at every sampling time until `ended` returns True.

    A command acts from the sampling time nearest to its arrival at this computer, however late
    this program runs: an answer within half a period acts from the sample that it answers.
    at_once: whether a command acts from its arrival on instead, within a period.
    speed: times as fast as the clock on the wall.
    tell: takes a sentence when this computer stood still, at most once a second.
    """
    schedule = Schedule(rig.period_s / speed)
    samples = commands = 0
    waiting: list[tuple[Command, int]] = []
    looks = max(round(speed / rig.period_s), 1)  # samples in a second
    while not ended():
        schedule.wait_for(samples)
        port.send(rig.sample.pack())
        late_s = schedule.wait_for(samples + (1.0 if at_once else 0.5))
        last_ns = time.time_ns() - round(1e9 * late_s)
        waiting += port.take_waiting_stamped()
        in_time = sum(arrival_ns <= last_ns for _, arrival_ns in waiting)
        if at_once:
            rig.step(_share_out(waiting[:in_time], last_ns, 1e9 * rig.period_s / speed))
        else:
            for command, _ in waiting[:in_time]:
                rig.take(command)
            rig.step()
        waiting, commands = waiting[in_time:], commands + in_time
        samples += 1
        if samples % looks == 0:
            if schedule.longest_late_s > NAMED_S:
                tell(f"{describe_standstill(schedule.longest_late_s)}: samples came late")
            schedule.longest_late_s = 0.0
    return Served(samples, commands, schedule.given_up_s)


def _share_out(
    waiting: list[tuple[Command, int]], end_ns: int, period_ns: float
) -> list[tuple[float, Command]]:
    """Return the share of the period that ends at end_ns after which each command came."""
    return [
        (min(max(1.0 - (end_ns - arrival_ns) / period_ns, 0.0), 1.0), command)
        for command, arrival_ns in waiting
    ]


def serve_in_lockstep(rig: LiveRig, port: Port[Command], ended: Ended) -> Served:
    """Answer each command with the sample at the end of the period for which it was held.

    Returns when `ended` returns True.
    """
    exchanges = 0
    while not ended():
        command = port.receive(time.monotonic() + LONGEST_WAIT_S)
        if command is not None:
            rig.take(command)
            port.send(rig.step().pack())
            exchanges += 1
    return Served(exchanges, exchanges)

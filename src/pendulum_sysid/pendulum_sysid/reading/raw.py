"""What a bag holds, as it was recorded: nothing repaired, nothing resampled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.reading.sent_commands import SentCommands
from pendulum_sysid.records import CommandLatency
from pendulum_twin.arrays import Floats

JOINTS = ("cart", "pole")
STATE_CHANNELS = (*JOINTS, "cart_velocity", "pole_velocity")


@dataclass(frozen=True)
class RawRecording:
    """Hold the samples and commands of one recording with the times they carry.

    state_stamp_s: (n,) sampling times, s from the first; never falling, equal where a sample came
        twice.
    cart, pole: (n,) positions, m and rad; NaN where a message lacked the value or held no finite
        one; None when the recording has no such joint.
    state_received_s: (n,) when each sample was received, s from the first sampling time, without
        delays where the file tells them; None where nothing says so.
    cart_velocity, pole_velocity: (n,) as reported, m/s and rad/s; NaN and None as above.
    command_stamp_s: (m,) when each command was received, s from the first sampling time.
    command: (m,) PWM fraction, NaN where it was not finite; empty when there are no commands.
    lost_messages: messages of the two topics that the bag's index counts beyond those read, that
        cannot be read, or that are out of the order of their stamps.
    damaged_parts: parts of the file whose bytes are damaged, and which are left out.
    cut_short: whether a file ends before its end mark or is damaged, and no index shows that
        nothing was lost.
    given_up: how the plan of the recording stood at its end, when it was not played to its end;
        empty when it was, or when there was none.
    command_latency: how late commands act; None where the recording does not say.
    sent: where the driver sent other commands; None for the same, or where nothing says so.

    Raises UnusableRecording when there is one sample only, times run backwards, no joint is there,
    or more than 5 % of a channel is not finite.
    """

    name: str
    digest: str
    state_stamp_s: Floats
    cart: Floats | None
    pole: Floats | None
    command_stamp_s: Floats
    command: Floats
    cart_velocity: Floats | None = None
    pole_velocity: Floats | None = None
    state_received_s: Floats | None = None
    lost_messages: int = 0
    cut_short: bool = False
    given_up: str = ""
    damaged_parts: int = 0
    command_latency: CommandLatency | None = None
    sent: SentCommands | None = None

    def __post_init__(self) -> None:
        _check_times(self.state_stamp_s, self.cut_short)
        if self.cart is None and self.pole is None:
            raise UnusableRecording(
                "expected a joint named cart or pole, found neither: rename the joints of the "
                "messages"
            )
        for channel in STATE_CHANNELS:
            object.__setattr__(self, channel, _checked(channel, getattr(self, channel)))
        object.__setattr__(self, "command", _checked("command", self.command))

    @property
    def positions(self) -> dict[str, Floats]:
        """Return the positions of the joints that the recording has, joint -> (n,) m or rad."""
        joints = {joint: getattr(self, joint) for joint in JOINTS}
        return {joint: values for joint, values in joints.items() if values is not None}

    def get_velocity(self, joint: str) -> Floats | None:
        """Return the reported velocities of a joint, (n,) m/s or rad/s."""
        velocities: Floats | None = getattr(self, f"{joint}_velocity")
        return velocities


def suggest_more(cut_short: bool, remedy: str = "record longer") -> str:
    """Return how a sentence about too few messages ends: with what to do.

    remedy: where the file is whole; beside another copy where it is cut short.
    """
    if cut_short:
        return f" in a file that is cut off or damaged: copy it again, or {remedy}"
    return f": {remedy}"


def check_finite(times: Floats) -> None:
    """Raise UnusableRecording where a sampling time (n,), s, is NaN or infinite."""
    bad = np.flatnonzero(~np.isfinite(times))
    if len(bad):
        raise UnusableRecording(
            f"expected finite sampling times, found {len(bad)} of {len(times)} NaN or infinite, "
            f"the first at sample {bad[0]} (from 0): leave these samples out"
        )


def _check_times(stamps: Floats, cut_short: bool) -> None:
    if len(stamps) < 2:
        raise UnusableRecording(
            f"expected a recording of many samples, found {len(stamps)}{suggest_more(cut_short)}"
        )
    steps = np.diff(stamps)
    if np.any(steps < 0):
        at = int(np.argmax(steps < 0))
        raise UnusableRecording(
            f"expected sampling times that rise, found them run backwards by {-steps[at]:.6g} s "
            f"after sample {at} "
            f"({stamps[at]:.6g} s from the start): record again with one clock"
        )
    if stamps[-1] <= stamps[0]:
        raise UnusableRecording(
            f"expected sampling times that rise, found the same time in all {len(stamps)} "
            "messages: "
            "set header.stamp to the sampling time"
        )


def _checked(channel: str, values: Floats | None) -> Floats | None:
    """Return the values read-only, NaN for infinity; refuse a channel that lacks too many."""
    if values is None:
        return None
    values = np.array(values, dtype=np.float64)
    bad = ~np.isfinite(values)
    values[bad] = np.nan
    if bad.sum() > decisions.MOST_NOT_FINITE * len(values):
        raise UnusableRecording(
            f"expected finite values of {channel}, found {bad.sum()} of {len(values)} missing, "
            "NaN or infinite: "
            f"at most {decisions.MOST_NOT_FINITE:.0%} can be done without, so record again"
        )
    values.setflags(write=False)
    return values

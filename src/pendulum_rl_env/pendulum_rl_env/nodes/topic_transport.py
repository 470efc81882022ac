"""A rig or a twin over topics, as a transport."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from pendulum_rl_env.command_limits import check_limits
from pendulum_rl_env.nodes.rig_client import CONNECT_S, RigClient
from pendulum_rl_env.pacing.lockstep import LockstepPace
from pendulum_rl_env.pacing.real_time import RealTimePace
from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError
from pendulum_twin.reset_answer import parse_stamp
from pendulum_twin.rig import check_number


class TopicTransport:
    """Exchange `pwm` for `joint_states` with the driver or twin of a namespace.

    namespace: of the driver, or of the twin.
    lockstep: whether the twin waits for each command; False for real time.
    step_s: s; the period, in lockstep a whole number of the twin's.
    deadline_s: s; for a sample later than a command, at least step_s.
    reset_deadline_s: s; for a reset with discovery, which takes 20 s of it at most.
    pwm_limit: largest command that is to come, compared with the rig's own limit at each reset,
        see `check_limits`; None compares nothing.

    Each sample's info, floats:

    dt_s: s; from the stamp of the sample before (for an episode's first step: of the sample that
        its command answered).
    delay_s: s; from the stamp of the sample that the command answered to the command's sending; 0
        in lockstep. A command in time may be almost step_s late; the twin in process has no delay
        here, so a policy feels it as a dead time of the drive.
    age_s: s; from the stamp to the return of the sample; 0 in lockstep.
    latency_s: s; from the command to the arrival of the first sample stamped later.
    overrun_s: s; by which the command came after its step's end, 0 when in time.
    missed: steps since the reset whose command came too late.
    lost: samples since the reset that never came, by the gaps between stamps.
    stale: samples since the reset that were out of order; in lockstep, answers to commands of
        another program.

    pwm_limit: largest command that the rig takes, as of the last reset; infinite where it states
        none.

    Whatever leaves `reset` or `exchange` other than by a return, Ctrl-C included, publishes PWM 0
    first, as `close` does: close it in a `finally`. A driver sets PWM to 0 by itself 0.2 s after
    the last command, between steps, too.
    """

    def __init__(
        self,
        namespace: str = "rig",
        lockstep: bool = False,
        step_s: float = 0.03,
        deadline_s: float = 1.0,
        reset_deadline_s: float = 60.0,
        pwm_limit: float | None = None,
    ) -> None:
        check_number("step_s", step_s, 0.001, 1.0)
        check_number("deadline_s", deadline_s, step_s, 60.0)
        check_number("reset_deadline_s", reset_deadline_s, 0.001, 3600.0)
        self.step_s = step_s
        self._reset_deadline_s = reset_deadline_s
        self._pwm_limit = pwm_limit
        self._compared: float | None = None  # the rig's limit at the last comparison
        self._client: RigClient | None = RigClient(namespace)
        make = LockstepPace if lockstep else RealTimePace
        self._pace = make(self._client, step_s, deadline_s)

    def reset(self) -> Sample:
        """Call the reset service; return the first sample that shows the pendulum at rest.

        Raises NoAnswerError with the rig's own sentence when it refuses, or when no answer comes
        in time; BadInputError when the rig's commands have another unit than those to come.
        """
        with self._stop_on_error() as client:
            end_s = time.monotonic() + self._reset_deadline_s
            client.connect(min(CONNECT_S, self._reset_deadline_s))
            self._compare_limits(client)
            while True:  # a sample may come before the subscription is complete: then once more
                answer = client.reset(end_s - time.monotonic())
                if (sample := self._pace.begin(parse_stamp(answer))) is not None:
                    return _report_limit(sample, client)

    def exchange(self, command: float) -> Sample:
        """Publish a command (PWM fraction) and return the sample at the end of its step.

        Raises NoAnswerError when no such sample comes.
        """
        with self._stop_on_error() as client:
            if not math.isfinite(command):
                raise BadInputError(f"command: expected a finite PWM fraction, found {command}")
            return _report_limit(self._pace.exchange(command), client)

    def close(self) -> None:
        """Publish PWM 0 and end the node; a second time does nothing."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _compare_limits(self, client: RigClient) -> None:
        """Compare the limits of commands and rig, once for each limit that the rig states."""
        if self._pwm_limit is not None and client.pwm_limit != self._compared:
            check_limits(self._pwm_limit, client.pwm_limit, client.name)
            self._compared = client.pwm_limit

    @contextmanager
    def _stop_on_error(self) -> Iterator[RigClient]:
        """Give the client, and publish PWM 0 on any exception."""
        client = self._client
        if client is None:
            raise NoAnswerError("expected an open transport, found it closed: make another")
        try:
            yield client
        except BaseException as error:
            with suppress(RuntimeError):
                client.send(0.0)
            if isinstance(error, NoAnswerError) and client.unreadable:
                raise NoAnswerError(
                    f"{error}; the last that came could not be read: {client.unreadable}"
                ) from error
            raise


def _report_limit(sample: Sample, client: RigClient) -> Sample:
    """Return the sample with the rig's limit in its info."""
    limit = math.inf if client.pwm_limit is None else client.pwm_limit
    return replace(sample, info={**sample.info, "pwm_limit": limit})

"""A rig behind the pipes of a program, as a transport: the rig's own packets in lockstep, no clock and no network."""

from __future__ import annotations

import contextlib
import select
import struct
import subprocess
import tempfile
import time
from collections.abc import Sequence

import numpy as np

from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError

COMMAND_PACKET, SAMPLE_PACKET = (
    struct.Struct(">dd"),
    struct.Struct(">dddd"),
)  # PWM, reset flag; angle, rate, position, velocity
ENDING_S = 2.0  # given to the program to end by itself
STDERR_TAIL_BYTES = 4096  # bytes of what it said on stderr that are looked at


class ProcessTransport:
    """Exchange packets with a program that answers every command with one sample.

    command: the program and its arguments. It reads `>dd` (PWM fraction, reset flag) and writes
    `>dddd` (pole angle in rad, 0 upright; pole rate; cart position in m; cart velocity). step_s:
    for how long it holds a command, which it has to be told by its own arguments. deadline_s: for
    one answer; the first is also that to its start. A program that misses it is ended, for its
    answers no longer belong to commands. Raises BadInputError when the program cannot be run.
    """

    def __init__(self, command: Sequence[str], step_s: float, deadline_s: float = 10.0) -> None:
        self.step_s = step_s
        self._name, self._deadline_s = " ".join(command[:3]), deadline_s
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (closed by close)
        self._steps = 0
        try:  # a session of its own: Ctrl-C reaches this process alone, which then closes it
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._said,
                bufsize=0,
                start_new_session=True,
            )
        except OSError as error:
            self._said.close()
            raise BadInputError(
                f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
            ) from error
        assert self._process.stdin is not None and self._process.stdout is not None
        self._commands, self._answers = self._process.stdin, self._process.stdout
        self._poll = select.poll()
        self._poll.register(self._answers, select.POLLIN)

    def reset(self) -> Sample:
        """Make the rig anew, hanging at rest in the middle; raise `NoAnswerError` when it does not answer."""
        self._steps = 0
        return self._asked(0.0, 1.0, 0.0)

    def exchange(self, command: float) -> Sample:
        """Hold the command for a period; return the sample at its end, or raise `NoAnswerError`."""
        self._steps += 1
        return self._asked(command, 0.0, self.step_s)

    def close(self) -> None:
        """End the program."""
        if self._said.closed:
            return
        with contextlib.suppress(OSError):
            self._commands.close()  # which is how it is told
        self._end()
        self._answers.close()
        self._said.close()

    def _asked(self, pwm: float, flag: float, dt_s: float) -> Sample:
        if self._said.closed:
            raise NoAnswerError(
                f"{self._name}: expected a program that runs, found it closed: make another transport"
            )
        try:
            self._commands.write(COMMAND_PACKET.pack(pwm, flag))
        except OSError as error:
            raise self._gone() from error
        angle, rate, position, velocity = SAMPLE_PACKET.unpack(self._answer())
        return Sample(
            np.array([position, angle, velocity, rate]), self._steps * self.step_s, {"dt_s": dt_s}
        )

    def _answer(self) -> bytes:
        """Return the bytes of one sample."""
        packet, end = b"", time.monotonic() + self._deadline_s
        while len(packet) < SAMPLE_PACKET.size:
            if not self._poll.poll(max(end - time.monotonic(), 0.0) * 1e3):
                self._process.kill()
                raise NoAnswerError(
                    f"{self._name}: expected a sample within {self._deadline_s:g} s, found none{self._last_words()}: "
                    "start it by hand to see what holds it up"
                )
            part = self._answers.read(SAMPLE_PACKET.size - len(packet))
            if not part:
                raise self._gone()
            packet += part
        return packet

    def _gone(self) -> NoAnswerError:
        self._end()
        status = self._process.returncode
        return NoAnswerError(
            f"{self._name}: expected a sample, but it ended with status {status}{self._last_words()}"
        )

    def _last_words(self) -> str:
        self._said.seek(max(self._said.seek(0, 2) - STDERR_TAIL_BYTES, 0))
        lines = [
            line
            for line in self._said.read().decode(errors="replace").splitlines()
            if line.strip()
        ]
        return f" and said last: {lines[-1].strip()}" if lines else ""

    def _end(self) -> None:
        try:
            self._process.wait(ENDING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

"""A rig behind the pipes of a program, as a transport: packets in lockstep, without a network."""

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

COMMAND_PACKET = struct.Struct(">dd")  # PWM fraction, reset flag
SAMPLE_PACKET = struct.Struct(">dddd")  # pole angle, pole rate, cart position, cart velocity
ENDING_S = 2.0  # given to the program to end by itself
STDERR_TAIL_BYTES = 4096  # of what the program wrote on stderr, searched for its last line


class ProcessTransport:
    """Exchange packets with a program that answers every command with one sample.

    The program reads `>dd` (PWM fraction, reset flag) and writes `>dddd` (pole angle, rad, 0
    upright; pole rate, rad/s; cart position, m; cart velocity, m/s).

    command: the program and its arguments.
    step_s: s; how long the program holds a command, which its own arguments have to say.
    deadline_s: s; for one answer, the first of which includes the start. A program that misses it
        is ended, for its answers no longer belong to commands.

    Raises BadInputError when the program cannot be run.
    """

    def __init__(self, command: Sequence[str], step_s: float, deadline_s: float = 10.0) -> None:
        self.step_s = step_s
        self._name, self._deadline_s = " ".join(command[:3]), deadline_s
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 (closed by close)
        self._steps = 0
        try:  # a session of its own: Ctrl-C reaches this process alone, which then closes it
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._stderr,
                bufsize=0,
                start_new_session=True,
            )
        except OSError as error:
            self._stderr.close()
            raise BadInputError(
                f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
            ) from error
        assert self._process.stdin is not None and self._process.stdout is not None
        self._commands, self._answers = self._process.stdin, self._process.stdout
        self._poll = select.poll()
        self._poll.register(self._answers, select.POLLIN)

    def reset(self) -> Sample:
        """Make the rig anew, hanging at rest in the middle; raise NoAnswerError on a failure."""
        self._steps = 0
        return self._ask(0.0, 1.0, 0.0)

    def exchange(self, command: float) -> Sample:
        """Hold the command for a period; return the sample at its end, or raise NoAnswerError."""
        self._steps += 1
        return self._ask(command, 0.0, self.step_s)

    def close(self) -> None:
        """End the program."""
        if self._stderr.closed:
            return
        with contextlib.suppress(OSError):
            self._commands.close()  # the program's sign to end
        self._end()
        self._answers.close()
        self._stderr.close()

    def _ask(self, pwm: float, flag: float, dt_s: float) -> Sample:
        if self._stderr.closed:
            raise NoAnswerError(
                f"{self._name}: expected a program that runs, found it closed: make another "
                "transport"
            )
        try:
            self._commands.write(COMMAND_PACKET.pack(pwm, flag))
        except OSError as error:
            raise self._make_ended_error() from error
        angle, rate, position, velocity = SAMPLE_PACKET.unpack(self._read_answer())
        return Sample(
            np.array([position, angle, velocity, rate]), self._steps * self.step_s, {"dt_s": dt_s}
        )

    def _read_answer(self) -> bytes:
        """Return the bytes of one sample."""
        packet, end_s = b"", time.monotonic() + self._deadline_s
        while len(packet) < SAMPLE_PACKET.size:
            if not self._poll.poll(max(end_s - time.monotonic(), 0.0) * 1e3):
                self._process.kill()
                raise NoAnswerError(
                    f"{self._name}: expected a sample within {self._deadline_s:g} s, found "
                    f"none{self._quote_stderr()}: start it by hand to see what holds it up"
                )
            received = self._answers.read(SAMPLE_PACKET.size - len(packet))
            if not received:
                raise self._make_ended_error()
            packet += received
        return packet

    def _make_ended_error(self) -> NoAnswerError:
        self._end()
        status = self._process.returncode
        return NoAnswerError(
            f"{self._name}: expected a sample, but it ended with status "
            f"{status}{self._quote_stderr()}"
        )

    def _quote_stderr(self) -> str:
        """Return the program's last line on stderr as a clause; nothing when it wrote none."""
        self._stderr.seek(max(self._stderr.seek(0, 2) - STDERR_TAIL_BYTES, 0))
        text = self._stderr.read().decode(errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        return f" and said last: {lines[-1]}" if lines else ""

    def _end(self) -> None:
        try:
            self._process.wait(ENDING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

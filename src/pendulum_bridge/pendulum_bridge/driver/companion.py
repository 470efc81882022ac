"""One companion process of `last_word.LastWord`, seen from the driver: whether it works."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from pendulum_bridge.driver import last_word_program
from pendulum_bridge.driver.last_word_program import BEAT, GOODBYE, READY

PROGRAM = Path(last_word_program.__file__)
READY_S = 10.0  # longest time for a companion to start: a busy machine takes its time
ANSWER_S = 5.0  # a companion that is stopped; on a busy computer a companion may wait for 1 s
END_S = 2.0  # longest time for a companion to end


class Companion:
    """Hold a companion process from its start to its end.

    packet: the packet with PWM 0.
    silence_s: s; after so long without a beat the companion sends the packet.
    program: file of the program.
    now: s, monotonic; the clock.

    Raises OSError when no process can be started.
    """

    def __init__(
        self,
        packet: bytes,
        silence_s: float,
        program: Path = PROGRAM,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._now, self._ready = now, False
        self.control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.control.setblocking(False)
        # -I -S: no start-up hooks, no site packages, no PYTHON* variables
        command = [sys.executable, "-I", "-S", str(program)]
        arguments = [str(theirs.fileno()), repr(silence_s), packet.hex()]
        nothing = subprocess.DEVNULL
        try:
            with theirs:
                self.process = subprocess.Popen(
                    [*command, *arguments],
                    pass_fds=[theirs.fileno()],
                    start_new_session=True,
                    stdin=nothing,
                    stdout=nothing,
                    stderr=nothing,
                )
        except BaseException:
            self.control.close()
            raise
        self._asked_s: float | None = now()  # when the first unanswered message went out

    @property
    def ready(self) -> bool:
        """Whether the companion works and would speak now."""
        return self._ready and self.works

    @property
    def works(self) -> bool:
        """Whether the companion runs and answers, or still has time to start."""
        if self.process.poll() is not None:
            return False
        patience_s = ANSWER_S if self._ready else READY_S
        return self._asked_s is None or self._now() - self._asked_s < patience_s

    def beat(self) -> None:
        """Take the answers so far, and report that the driver works. Never blocks."""
        self.hear()
        self.control.send(BEAT)
        if self._asked_s is None:
            self._asked_s = self._now()

    def hear(self) -> None:
        """Take the answers so far. Never blocks, never raises."""
        with contextlib.suppress(OSError):  # there is none, or the companion has ended
            while message := self.control.recv(1):
                self._ready = self._ready or message == READY
                self._asked_s = None

    def kill(self) -> None:
        """End a companion that does not work, without waiting for its end."""
        self.control.close()
        self.process.kill()

    def close(self) -> None:
        """End the companion without a packet to the rig; a second call does nothing."""
        with contextlib.suppress(OSError):
            self.control.send(GOODBYE)
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        # only now: with answers unread, a closed socket would reset the goodbye away
        self.control.close()

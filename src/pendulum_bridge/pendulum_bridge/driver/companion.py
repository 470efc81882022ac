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
ANSWER_S = 1.0  # a companion without an answer for so long might not speak in time
REPLACE_S = 5.0  # one that is stopped; on a busy computer a companion may wait for 1 s
# a longer time between two looks counts as this: it was the driver that stood still
LONGEST_TURN_S = 0.05
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
        self._looked_s, self._waited_s = now(), 0.0
        self._unanswered = True  # it still has to say that it is ready
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

    @property
    def ready(self) -> bool:
        """Whether the companion works and would speak now."""
        return self._ready and self.works and self._waited_s < ANSWER_S

    @property
    def silent(self) -> bool:
        """Whether the companion was ready and owes an answer: stopped, or starved of time."""
        return self._ready and self.works and self._waited_s >= ANSWER_S

    @property
    def works(self) -> bool:
        """Whether the companion runs and answers, or still has time to start."""
        if self.process.poll() is not None:
            return False
        return self._waited_s < (REPLACE_S if self._ready else READY_S)

    def beat(self) -> None:
        """Take the answers so far, and report that the driver works. Never blocks."""
        self.hear()
        self._unanswered = True
        self.control.send(BEAT)

    def hear(self) -> None:
        """Take the answers so far. Never blocks, never raises."""
        now_s = self._now()
        if self._unanswered:
            self._waited_s += min(now_s - self._looked_s, LONGEST_TURN_S)
        self._looked_s = now_s
        with contextlib.suppress(OSError):  # there is none, or the companion has ended
            while message := self.control.recv(1):
                self._ready = self._ready or message == READY
                self._unanswered, self._waited_s = False, 0.0

    def kill(self) -> None:
        """End a companion that does not work, without waiting for its end."""
        self.control.close()
        self.process.kill()

    def leave(self) -> None:
        """Let the companion send the packet until it goes out, some seconds at most, and end."""
        self.control.close()

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

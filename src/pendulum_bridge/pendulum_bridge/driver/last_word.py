"""PWM 0 to the rig when the driver can no longer send it: the rig holds its last command for ever.

A process that is killed (SIGKILL) or stopped (SIGSTOP) executes nothing, so another process has to
speak for it. The companion (`last_word_program.py`) shares the driver's own socket, so the rig
takes its packet for the driver's.
"""

from __future__ import annotations

import contextlib
import select
import socket
import subprocess
import sys
from pathlib import Path
from typing import Protocol, Self

from pendulum_bridge.driver import last_word_program
from pendulum_bridge.driver.last_word_program import BEAT, GOODBYE, READY, SOCKET
from pendulum_twin.errors import BadInputError

PROGRAM = Path(last_word_program.__file__)
# longest time for the companion to start and to end: a busy machine takes its time
READY_S, END_S = 10.0, 2.0


class SharedLink(Protocol):
    """Show the socket of a link that a companion shares; see `link.Link`."""

    @property
    def connections(self) -> int:
        """The number of connections so far."""

    @property
    def peer(self) -> tuple[str, int] | None:
        """The address to send to; None when the socket itself knows it."""

    def fileno(self) -> int:
        """Return the socket's number; -1 while there is none."""


class LastWord:
    """Keep a companion process that sends a packet when this process no longer can.

    The companion sends the packet several times when this process ends without `close`, and
    repeatedly
    while `alive` has not been called for silence_s. It ends a moment after this process. Signals
    to
    this process's group do not reach it; SIGINT and SIGTERM do not end it. Close it before the
    link,
    or use it in a `with`.

    link: whose socket the companion shares.
    packet: the packet with PWM 0.
    silence_s: s; longest time between two calls of `alive`.

    Raises BadInputError when the companion does not get ready.
    """

    def __init__(self, link: SharedLink, packet: bytes, silence_s: float = 0.2) -> None:
        self._link, self._handed_over = link, 0
        self._control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._control.setblocking(False)
        # -I -S: no start-up hooks, no site packages, no PYTHON* variables
        command = [
            sys.executable,
            "-I",
            "-S",
            str(PROGRAM),
            str(theirs.fileno()),
            repr(silence_s),
            packet.hex(),
        ]
        nothing = subprocess.DEVNULL
        with theirs:
            self._process = subprocess.Popen(
                command,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
                stdin=nothing,
                stdout=nothing,
                stderr=nothing,
            )
        self.alive()
        if not self._ready():
            self.close()
            raise BadInputError(
                f"last word: expected its process to be ready within {READY_S:g} s: run {PROGRAM} "
                "by hand"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def running(self) -> bool:
        """Whether the companion still runs; without it nobody speaks for this process."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """The companion's process number."""
        return self._process.pid

    def alive(self) -> None:
        """Report that this process works, at least every 30 ms. Never blocks, never raises."""
        # the companion has ended, or is full of beats, or the link has just lost its socket
        with contextlib.suppress(OSError, ValueError):
            if self._link.connections != self._handed_over:
                self._hand_over()
            self._control.send(BEAT)

    def close(self) -> None:
        """End the companion without a packet to the rig; a second call does nothing."""
        with contextlib.suppress(OSError):
            self._control.send(GOODBYE)
        self._control.close()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _ready(self) -> bool:
        """Wait until the companion reports that it is ready; return False when it does not."""
        select.select([self._control], [], [], READY_S)
        try:
            return self._control.recv(1) == READY
        except OSError:  # the companion has ended, or is silent
            return False

    def _hand_over(self) -> None:
        """Give the companion the link's present socket."""
        # the count first, so that a newer socket is handed over once more
        count, peer = self._link.connections, self._link.peer
        if (number := self._link.fileno()) >= 0:
            where = f"{peer[0]}:{peer[1]}" if peer else ""
            socket.send_fds(self._control, [SOCKET + where.encode()], [number])
            self._handed_over = count

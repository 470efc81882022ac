"""PWM 0 to the rig when the driver can no longer send it: the rig holds its last command for ever.

A process that is killed (SIGKILL) or stopped (SIGSTOP) executes nothing, so another process has to
speak for it. The companion (`last_word_program.py`) shares the driver's own socket, so the rig
takes its packet for the driver's. A companion that was itself killed or stopped is replaced. While
it does not answer, and until the new one is ready, nobody could speak: the driver sends PWM 0.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Callable
from typing import Protocol, Self

from pendulum_bridge.driver import companion
from pendulum_bridge.driver.companion import READY_S, Companion
from pendulum_bridge.driver.last_word_program import SOCKET
from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError

RETRY_S = 1.0  # from one attempt to replace a companion to the next


def describe_left_pwm(pwm: float, fault: str) -> str:
    """Return that the rig may hold a command at the end of a program, and what to do.

    pwm: PWM fraction that went out last.
    fault: why PWM 0 did not go out.
    """
    return (
        f"expected to send PWM 0 to the rig at the end, found that it did not go out ({fault}): "
        f"the rig may hold PWM {pwm:g}: switch it off"
    )


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
    repeatedly while `alive` has not been called for silence_s. It ends a moment after this
    process, or after some seconds in which the network refused its packets. Signals to this
    process's group do not reach it; SIGINT and SIGTERM do not end it. Close it before the link, or
    use it in a `with`. One thread calls `alive`.

    link: whose socket the companion shares.
    packet: the packet with PWM 0.
    silence_s: s; longest time between two calls of `alive`.
    now: s, monotonic; the clock.

    Raises BadInputError when the companion does not get ready.
    """

    def __init__(
        self,
        link: SharedLink,
        packet: bytes,
        silence_s: float = 0.2,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._link, self._packet, self._silence_s, self._now = link, packet, silence_s, now
        self._ended: list[Companion] = []  # killed, and perhaps not gone yet
        self._closed = False
        self.replaced = 0
        self._retry_s = -RETRY_S
        self._handed_over = 0
        try:
            self._companion = self._start()
        except OSError as error:
            raise BadInputError(
                f"last word: expected a process, found {error.strerror}"
            ) from error
        self.alive()
        select.select([self._companion.control], [], [], READY_S)
        self._companion.hear()
        if not self.running:
            self.close()
            raise BadInputError(
                f"last word: expected its process to be ready within {READY_S:g} s: run "
                f"{companion.PROGRAM} by hand"
            )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def running(self) -> bool:
        """Whether a companion would speak now; without one nobody speaks for this process."""
        return self._companion.ready

    @property
    def fault(self) -> Reason | None:
        """Why no companion would speak now; None while one would."""
        if self.running:
            return None
        return Reason.LAST_WORD_SILENT if self._companion.silent else Reason.NO_LAST_WORD

    @property
    def pid(self) -> int:
        """The companion's process number."""
        return self._companion.process.pid

    def alive(self) -> None:
        """Report that this process works, at least every 30 ms. Never blocks, never raises.

        A companion that has ended, or does not answer for long, is replaced.
        """
        # the companion has ended, or is full of beats, or the link has just lost its socket
        with contextlib.suppress(OSError, ValueError):
            self._companion.hear()
            if not self._companion.works and not self._closed:
                self._replace()
            if self._link.connections != self._handed_over:
                self._hand_over()
            self._companion.beat()

    def close(self, left_pwm: float = 0.0) -> None:
        """End the companion; a second call does nothing.

        left_pwm: PWM fraction that went out last. After 0 the companion ends without a packet to
            the rig; otherwise it goes on alone until its packet goes out, some seconds at most.
        """
        if self._closed:
            return
        self._closed = True
        if left_pwm:
            self._companion.leave()
            return
        for each in (*self._ended, self._companion):
            each.close()

    def _start(self) -> Companion:
        return Companion(self._packet, self._silence_s, companion.PROGRAM, self._now)

    def _replace(self) -> None:
        """Start another companion, at most once in RETRY_S; raise OSError when that fails."""
        self._ended = [each for each in self._ended if each.process.poll() is None]
        if self._now() < self._retry_s:
            return
        self._retry_s = self._now() + RETRY_S
        self._companion.kill()
        self._ended.append(self._companion)
        self._companion = self._start()
        self._handed_over = 0
        self.replaced += 1

    def _hand_over(self) -> None:
        """Give the companion the link's present socket."""
        # the count first, so that a newer socket is handed over once more
        count, peer = self._link.connections, self._link.peer
        if (number := self._link.fileno()) >= 0:
            where = f"{peer[0]}:{peer[1]}" if peer else ""
            socket.send_fds(self._companion.control, [SOCKET + where.encode()], [number])
            self._handed_over = count

"""The companion process of `last_word.LastWord`: it sends the last packet for another process.

A bare Python runs it as a bare file (`python -I -S`), so it may import only the standard library.
That way it starts within some 20 ms, whatever the environment is, and nothing that breaks the
driver breaks it too.

Arguments: number of the control socket (each message of the driver is whole), longest silence in
s, packet in hex.
"""

from __future__ import annotations

import contextlib
import select
import signal
import socket
import sys
import time

# messages; SOCKET is followed by HOST:PORT or nothing
READY, BEAT, SOCKET, GOODBYE = b"r", b".", b"s", b"q"
LONGEST_MESSAGE = 128
LAST_WORDS, BETWEEN_S = 5, 0.01  # packets after the driver's end, as any may be lost
PATIENCE_S = 5.0  # after the driver's end; so long a network that refuses packets is tried again
REPEATED_S = 0.05  # time between packets while the driver is silent


class WayOut:
    """Send over the socket that the driver handed over last.

    packet: the packet to send.
    """

    def __init__(self, packet: bytes) -> None:
        self._packet = packet
        self._socket: socket.socket | None = None
        self._peer: tuple[str, int] | None = None

    def take(self, number: int, peer: str) -> None:
        """Use this socket from now on.

        peer: HOST:PORT; empty when the socket itself knows its peer.
        """
        if self._socket is not None:
            self._socket.close()
        host, _, port = peer.rpartition(":")
        self._socket, self._peer = (
            socket.socket(fileno=number),
            (host, int(port)) if peer else None,
        )

    def speak(self) -> bool:
        """Send the packet once; return whether the network took it. There may be no socket yet."""
        try:
            if self._socket is not None and self._peer is not None:
                self._socket.sendto(self._packet, self._peer)
            elif self._socket is not None:
                self._socket.send(self._packet)
        except OSError:
            return False
        return True


def main(arguments: list[str]) -> int:
    """Watch until the driver ends or says goodbye; return 0."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)  # the companion ends after the driver
    control = socket.socket(fileno=int(arguments[0]))
    way_out = WayOut(bytes.fromhex(arguments[2]))
    control.send(READY)
    if not watch_driver(control, way_out, float(arguments[1])):
        say_last_words(way_out)
    return 0


def say_last_words(way_out: WayOut, patience_s: float = PATIENCE_S) -> None:
    """Send the packet until LAST_WORDS of them went out, at most for patience_s (s)."""
    end_s, out = time.monotonic() + patience_s, 0
    while out < LAST_WORDS and time.monotonic() < end_s:
        out += way_out.speak()
        select.select([], [], [], BETWEEN_S)


def watch_driver(control: socket.socket, way_out: WayOut, silence_s: float) -> bool:
    """Send the packet while the driver is silent; return whether it said goodbye when it ended."""
    due = time.monotonic() + silence_s
    while True:
        if select.select([control], [], [], max(due - time.monotonic(), 0.0))[0]:
            message = hear_message(control, way_out)
            if message in (b"", GOODBYE):
                return message == GOODBYE
            answer_driver(control)
            due = time.monotonic() + silence_s
        else:
            way_out.speak()
            due = time.monotonic() + REPEATED_S


def answer_driver(control: socket.socket) -> None:
    """Show the driver that this process works; a driver that does not listen holds nobody up."""
    with contextlib.suppress(OSError):
        control.send(BEAT, socket.MSG_DONTWAIT)


def hear_message(control: socket.socket, way_out: WayOut) -> bytes:
    """Return the next message, and take over the socket that came with it.

    The message is empty when the driver has ended.
    """
    try:
        message, sockets, _, _ = socket.recv_fds(control, LONGEST_MESSAGE, 1)
    except OSError:
        return b""
    for number in sockets:
        way_out.take(number, message[len(SOCKET) :].decode())
    return message


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

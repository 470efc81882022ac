"""Who is connected to the page's server, and who goes when too many are.

A program that opens connections and asks for nothing must not keep the page and its stop button
from a person. So the number of connections is bounded, below the number of files that a process
may open, and a new connection takes the place of the oldest connection without a request under
way, of the client that holds most.
"""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from collections.abc import Callable
from contextlib import suppress

MOST_CONNECTIONS = 128  # a browser opens six; most programs may open 1024 files
NO_FILE_LEFT_S = 0.05  # time until the next attempt, when this process can open no file


class Doorman:
    """Admit connections; the event loop's thread alone calls this.

    most: number of connections at a time.
    turned_away: number of connections that were closed for others so far.
    """

    def __init__(self, most: int = MOST_CONNECTIONS) -> None:
        self._most = most
        self._clients: dict[asyncio.BaseTransport, str] = {}  # the oldest first
        self._busy: set[asyncio.BaseTransport] = set()
        self.turned_away = 0

    def admit(self, transport: asyncio.Transport, client: str) -> None:
        """Take a new connection (client: its address), and close another when that is too many."""
        self._forget_closed()
        self._clients[transport] = client
        while len(self._clients) > self._most:
            self._turn_away(self._choose())

    def begin(self, transport: asyncio.BaseTransport | None) -> None:
        """Note that a request of a connection is under way: it stays."""
        if transport is not None:
            self._busy.add(transport)

    def end(self, transport: asyncio.BaseTransport | None) -> None:
        """Note that the request has been answered."""
        self._busy.discard(transport)  # type: ignore[arg-type]

    def _choose(self) -> asyncio.BaseTransport:
        idle = {t: client for t, client in self._clients.items() if t not in self._busy}
        if not idle:
            return next(reversed(self._clients))  # all are busy: the newest has to try again
        counts = Counter(self._clients.values())
        return max(idle, key=lambda transport: counts[idle[transport]])  # of equals the oldest

    def _turn_away(self, transport: asyncio.BaseTransport) -> None:
        del self._clients[transport]
        self.turned_away += 1
        if isinstance(transport, asyncio.Transport):
            transport.abort()

    def _forget_closed(self) -> None:
        for transport in [t for t in self._clients if t.is_closing()]:
            del self._clients[transport]
            self._busy.discard(transport)


async def accept_connections(
    listener: socket.socket, make: Callable[[], asyncio.BaseProtocol], doorman: Doorman
) -> None:
    """Accept for ever.

    listener: listens; made non-blocking.
    make: makes the protocol of a connection.
    doorman: decides who stays.
    """
    loop = asyncio.get_running_loop()
    listener.setblocking(False)
    while True:
        try:
            taken, address = await loop.sock_accept(listener)
        except OSError:  # the client has gone already, or no file is left
            await asyncio.sleep(NO_FILE_LEFT_S)
            continue
        with suppress(OSError):
            transport, _ = await loop.connect_accepted_socket(make, taken)
            assert isinstance(transport, asyncio.Transport)
            doorman.admit(transport, str(address[0]))

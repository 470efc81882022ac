"""Run a server in a thread of its own; its address is bound before, in the caller's thread."""

from __future__ import annotations

import asyncio
import errno
import socket
from collections.abc import Callable
from contextlib import suppress
from threading import Thread

from aiohttp import web

from pendulum_bridge.view.doorman import Doorman, accept_connections
from pendulum_twin.errors import BadInputError

LONGEST_END_S = 5.0
# a connection without a whole request is closed after so long: no browser is so slow
IDLE_S = 5.0
LINGER_S = 1.0  # for the rest of a request that has been answered


def open_listener(host: str, port: int) -> socket.socket:
    """Return a socket that listens; port 0 takes any free port.

    Raises BadInputError when the address cannot be used.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    taken = socket.socket(family, socket.SOCK_STREAM)
    try:
        # so that a node can follow another at once
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind((host, port))
        taken.listen()
    except OSError as error:
        taken.close()
        raise BadInputError(_explain_error(host, port, error)) from error
    return taken


def open_usual_listener(host: str, port: int, usual: int) -> socket.socket:
    """Return a socket on the port, or on any free port where the usual port is taken.

    usual: the port that nobody asked for; any other port that is taken is refused.
    """
    if port != usual or not _is_taken(host, port):
        return open_listener(host, port)
    return open_listener(host, 0)


def _is_taken(host: str, port: int) -> bool:
    try:
        open_listener(host, port).close()
    except BadInputError as error:
        cause = error.__cause__
        return isinstance(cause, OSError) and cause.errno == errno.EADDRINUSE
    return False


def format_url(taken: socket.socket) -> str:
    """Return the address of a page served on this socket."""
    host, port = taken.getsockname()[:2]
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def _explain_error(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"port: expected a free port of {host}, found {port} in use: give another one, or -p "
            "port:=0 for any"
        )
    if error.errno == errno.EACCES:
        return (
            f"port: expected one that you may listen on, found {port}: give one from 1024 on, or "
            "-p port:=0 for any"
        )
    return (
        f"host: expected an address of this machine, found {host!r} ({error.strerror}): give -p "
        "host:=127.0.0.1"
    )


class Serving:
    """Serve an application on a socket until closed.

    taken: the listening socket.
    make: makes the application and its doorman, in the server's thread and event loop.
    failed: gets a sentence when the server ends before it is closed.
    """

    def __init__(
        self,
        taken: socket.socket,
        make: Callable[[], tuple[web.Application, Doorman]],
        failed: Callable[[str], None],
    ) -> None:
        self._socket, self._make, self._failed = taken, make, failed
        self._loop = asyncio.new_event_loop()
        self._ended = asyncio.Event()
        self._thread = Thread(target=self._run, name="page", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the server, and wait until it has ended."""
        with suppress(RuntimeError):  # the server ended by itself
            self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(LONGEST_END_S)

    def _run(self) -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
                runner.run(self._serve())
        except Exception as error:
            self._failed(f"the page is no longer served: {error!r}")
        finally:
            self._socket.close()

    async def _serve(self) -> None:
        app, doorman = self._make()
        runner = web.AppRunner(
            app,
            access_log=None,
            handle_signals=False,
            shutdown_timeout=1.0,
            keepalive_timeout=IDLE_S,
            lingering_time=LINGER_S,
        )
        await runner.setup()
        assert runner.server is not None
        accepting = asyncio.create_task(
            accept_connections(self._socket, runner.server, doorman), name="accept"
        )
        ended = asyncio.create_task(self._ended.wait())
        try:
            await asyncio.wait((accepting, ended), return_when=asyncio.FIRST_COMPLETED)
            if accepting.done():
                accepting.result()
        finally:
            accepting.cancel()
            ended.cancel()
            await asyncio.gather(accepting, ended, return_exceptions=True)
            self._socket.close()
            await runner.cleanup()

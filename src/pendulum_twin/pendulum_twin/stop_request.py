"""The request that a program stops, which SIGINT and SIGTERM make however fast they come."""

import signal

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """A flag that any thread and any signal handler may set.

    A handler cannot set a threading.Event: the next signal interrupts the handler while it holds
    the event's lock, and then waits for that lock for ever. An assignment has no lock.
    """

    def __init__(self) -> None:
        self._is_set = False

    def set(self) -> None:
        """Ask the program to stop."""
        self._is_set = True

    def is_set(self) -> bool:
        """Return whether the program has been asked to stop."""
        return self._is_set


def catch_stop_signals() -> StopRequest:
    """Return the request that SIGINT and SIGTERM make from here on."""
    stopped = StopRequest()
    for number in STOP_SIGNALS:
        signal.signal(number, lambda *_: stopped.set())
    return stopped


def ignore_stop_signals() -> None:
    """Ignore SIGINT and SIGTERM from here on: a program that ends is not interrupted in it."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)

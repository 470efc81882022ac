"""Signals that a test run inherits from whoever started it."""

import signal


def restore_interrupt() -> None:
    """Stop ignoring SIGINT, so that programs which tests start can be interrupted.

    A process that is started under `nohup`, or in the background of a script, ignores SIGINT, and
    so does every program that it starts.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)

"""Notice that the program which started this one has ended."""

from __future__ import annotations

import os


class Parent:
    """Remember the present parent process.

    The caller polls `ended`: the kernel's own signal comes already when the thread ends that
    started
    this program.
    """

    def __init__(self) -> None:
        self._process = os.getppid()

    @property
    def ended(self) -> bool:
        """Whether this process has been handed on to another parent."""
        return os.getppid() != self._process

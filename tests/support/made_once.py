"""Folders that are made once a run of the tests, whichever worker asks first."""

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import pytest


def make_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """Return a folder that the first worker that asks for it fills by `make`; others wait.

    A folder whose making failed is made again by the next that asks, in a folder of its own.
    """
    base = factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    with (shared / f"{name}.lock").open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        ready = shared / f"{name}.ready"
        if not ready.exists():
            folder = factory.mktemp(name)
            make(folder)
            ready.write_text(str(folder))
        return Path(ready.read_text())

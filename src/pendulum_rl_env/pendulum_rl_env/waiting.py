"""Say a word when a start takes long, for otherwise a first start looks as if it hung."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

PATIENCE_S = 2.0  # a start with machine code in the cache takes less
COMPILING = (
    "compiling for this processor: about half a minute, once; later starts take it from the cache"
)


@contextmanager
def announce_compiling(name: str, patience_s: float = PATIENCE_S) -> Iterator[None]:
    """Print on stderr that the twin is being compiled when the block takes longer than patience_s.

    name: of the program or package, before the message.
    """
    timer = threading.Timer(
        patience_s, lambda: print(f"{name}: {COMPILING}", file=sys.stderr, flush=True)
    )
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()

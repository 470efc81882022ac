"""Share the lanes of a compiled pass among the processor's cores."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread

from numba.core import config

from pendulum_twin import kernel

LEAST_STEPS = 20_000  # of all lanes, for a thread: 0.6 to 1 ms; a thread costs 0.05 ms (measured)
MOST_THREADS = 8  # bounds what a call pays for its threads


def share_among_threads(work: Callable[[slice], None], lanes: int, steps: int) -> None:
    """Call work for parts of the lanes that together are all lanes, at the same time.

    work: takes a part of the lanes; releases the interpreter's lock, and raises nothing.
    steps: of integration in a lane.

    NUMBA_NUM_THREADS bounds the number of threads, by default the number of cores. Threads are
    made for each call: a pool of threads would not survive a fork.
    """
    cores = min(config.NUMBA_NUM_THREADS, MOST_THREADS)
    blocks = -(-lanes // kernel.WIDTH)
    if not blocks:
        return
    count = max(min(cores, blocks, lanes * steps // LEAST_STEPS), 1)
    size = -(-blocks // count) * kernel.WIDTH
    own, *parts = [slice(begin, min(begin + size, lanes)) for begin in range(0, lanes, size)]
    others = [Thread(target=work, args=(part,)) for part in parts]
    for other in others:
        other.start()
    work(own)
    for other in others:
        other.join()

"""The live frames and the last seconds of the plots; a reader gets the newest frame."""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import Callable
from itertools import islice
from typing import Any

from pendulum_bridge.view.frame import COLUMNS, make_frame, make_point
from pendulum_bridge.view.samples import Snapshot

RATE_HZ = 30.0
HISTORY_S = 15.0  # that a page shows, and gets at once
KEPT_S = 600.0  # that a page may scroll back


class Feed:
    """Make a frame at every tick, for readers in the same event loop.

    Frames are numbered from 0. A reader names the frame that it has; the answer holds the newest
    frame
    and the points of all frames since, so that a slow reader misses nothing and nothing piles up.

    look: returns the snapshot at a time (s, monotonic).
    fixed: keys that every frame holds besides.
    number: number of the newest frame; -1 before the first.
    """

    def __init__(
        self, look: Callable[[float], Snapshot], fixed: dict[str, Any] | None = None
    ) -> None:
        self._look = look
        self._fixed = {
            "history_s": HISTORY_S, "kept_s": KEPT_S, "columns": COLUMNS, **(fixed or {}),
        }  # fmt: skip
        self._points: deque[list[float | None]] = deque(maxlen=round(HISTORY_S * RATE_HZ))
        self._kept: deque[list[float | None]] = deque(maxlen=round(KEPT_S * RATE_HZ))
        self._latest: dict[str, Any] = {}
        self._ticked = asyncio.Event()
        self.number = -1

    def tick(self, now_s: float) -> None:
        """Make the frame of now_s (s, monotonic)."""
        self._latest = make_frame(self._look(now_s))
        point = make_point(self._latest)
        self._points.append(point)
        self._kept.append(point)
        self.number += 1
        ticked, self._ticked = self._ticked, asyncio.Event()
        ticked.set()

    async def wait_for_newer(self, number: int) -> None:
        """Wait until there is a frame after this number."""
        while self.number <= number:
            await self._ticked.wait()

    def write_text(self, after: int) -> str:
        """Return the newest frame as JSON, with the points of all frames after a number.

        after: the number; all points are returned for an unknown number.
        """
        known = -1 if after > self.number else max(after, -1)
        missed = min(self.number - known, len(self._points))
        points = list(islice(self._points, len(self._points) - missed, None))
        return json.dumps(
            {**self._fixed, **self._latest, "number": self.number, "points": points},
            allow_nan=False,
        )

    async def write_history(self) -> str:
        """Return the points of the last ten minutes as JSON, in a thread: they are many."""
        points = list(self._kept)
        return await asyncio.to_thread(json.dumps, {"columns": COLUMNS, "points": points})


async def keep_ticking(
    feed: Feed, clock: Callable[[], float], complain: Callable[[str], None]
) -> None:
    """Tick for ever; a failed tick is reported to complain, and the next tick follows."""
    loop = asyncio.get_running_loop()
    due_s = loop.time()
    while True:
        try:
            feed.tick(clock())
        except Exception as error:  # a page that stands still looks like a rig that does
            complain(f"no frame: {error!r}")
        due_s = max(due_s + 1 / RATE_HZ, loop.time())
        await asyncio.sleep(due_s - loop.time())

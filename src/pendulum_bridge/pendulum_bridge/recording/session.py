"""A running recording: when to write, when to end, and its health."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Mapping

from pendulum_twin.bags.bag import MEGABYTE, Bag
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health, Level

FLUSH_S = 0.25  # a kill costs at most this time, and that of a flush
REFRESH_S = 5.0  # largest age of the index beside the data
RATE_SPAN_S = 0.5  # shortest time over which a rate is measured


class Session:
    """Write messages to a bag until it is closed, its time is over, or the disk fails.

    bag: where to write.
    seconds: length of the recording from the first message; 0: until `close`.
    now_s: time of a steady clock, here and in all methods.
    """

    def __init__(self, bag: Bag, seconds: float, now_s: float) -> None:
        self._bag, self._seconds = bag, seconds
        self._flushed_s = self._refreshed_s = now_s
        self._first_s: float | None = None
        self._rate_from = (now_s, 0)
        self._rate_hz = 0.0
        self._dropped: dict[str, int] = {}
        self.failure = ""
        self.finished = False

    @property
    def ended(self) -> bool:
        """Return whether the session takes no more messages."""
        return self.finished or bool(self.failure)

    def take(
        self,
        topics: Iterable[Topic],
        messages: Collection[Message],
        dropped: Mapping[str, int],
        now_s: float,
    ) -> None:
        """Keep the messages, and write when writing is due.

        topics: new topics; the messages are of these and earlier topics.
        dropped: topic -> number of messages that were lost so far.
        """
        if self.ended:
            return
        for topic in topics:
            self._bag.add_topic(topic)
        for message in messages:
            self._bag.keep(message)
        self._dropped = dict(dropped)
        if messages and self._first_s is None:
            self._first_s = now_s
        self.finished = (
            bool(self._seconds)
            and self._first_s is not None
            and now_s - self._first_s >= self._seconds
        )
        if now_s - self._flushed_s >= FLUSH_S:
            self._flushed_s = now_s
            self._write(now_s)

    def keep(self, key: str, value: str) -> None:
        """Keep a remark with the recording; it is written with the next index."""
        self._bag.custom[key] = value

    def _write(self, now_s: float) -> None:
        try:
            self._bag.flush()
            if now_s - self._refreshed_s >= REFRESH_S:
                self._refreshed_s = now_s
                self._bag.custom["dropped"] = json.dumps(self._dropped)
                self._bag.refresh()
        except BadInputError as error:
            self.failure = str(error)
        except OSError as error:
            self.failure = (
                f"{self._bag.folder}: expected to write the index, found {error.strerror}: "
                "record again"
            )

    def close(self) -> None:
        """Close the bag; raise BadInputError with the reason when the recording failed."""
        self._bag.custom["dropped"] = json.dumps(self._dropped)
        try:
            self._bag.close()
        except BadInputError as error:
            self.failure = self.failure or str(error)
        if self.failure:
            raise BadInputError(self.failure)

    def health(self, waiting: Collection[str], now_s: float) -> Health:
        """Return the session's health, with the rate since the last call.

        waiting: topics that nobody publishes so far.
        """
        total, lost = self._bag.tally.total, sum(self._dropped.values())
        since_s, before = self._rate_from
        if now_s - since_s >= RATE_SPAN_S:
            self._rate_hz, self._rate_from = (total - before) / (now_s - since_s), (now_s, total)
        figures: dict[str, float | int | str] = {
            "messages": total,
            "rate_hz": self._rate_hz,
            "dropped": lost,
            "bytes": self._bag.size_bytes,
            "seconds": self._bag.tally.duration_ns / 1e9,
            "waiting_for": ", ".join(waiting),
        }
        if self.failure:
            return Health(Level.ERROR, self.failure, figures)
        if lost:
            return Health(Level.WARN, f"{lost} messages were dropped", figures)
        if not total:
            return Health(
                Level.WARN,
                f"no message yet; nobody publishes {', '.join(waiting) or 'any'}",
                figures,
            )
        return Health(Level.OK, f"recording to {self._bag.folder}", figures)

    @property
    def summary(self) -> str:
        """Return a line about what is recorded so far."""
        tally, lost = self._bag.tally, sum(self._dropped.values())
        return (
            f"{tally.duration_ns / 1e9:.1f} s, {tally.total} messages, {lost or 'none'} dropped, "
            f"{self._bag.size_bytes / MEGABYTE:.1f} MB in {self._bag.folder}"
        )

"""When messages were published: a busy computer receives a message late, and publishes it in time.

Recorders of ROS 2 keep both times of a message: the publisher's, and their own.
"""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid import decisions


def find_sending_times(received_ns: Sequence[int], published_ns: Sequence[int]) -> list[int]:
    """Return the times (n), ns, at which messages would have been received without delays.

    These are the publisher's times plus the least latency, which also holds what the clocks of two
    computers differ by. Where a message would have been under way for longer than
    `LONGEST_LATENCY_S`, or have come before it went, the two times are of different clocks (of
    simulated and real time, for instance), and the times of receiving are returned.

    received_ns, published_ns: (n) of each message, below 2^64.
    """
    latencies = [here - there for here, there in zip(received_ns, published_ns, strict=True)]
    longest = 1e9 * decisions.LONGEST_LATENCY_S
    if not all(0 <= latency < longest for latency in latencies):
        return list(received_ns)
    least = min(latencies, default=0)
    return [published + least for published in published_ns]

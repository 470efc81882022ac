"""What a twin answers to a reset: a sentence that, in lockstep, ends with the stamp of the start state's sample.

A sample and an answer come by different ways, in any order; by the stamp a user tells the start
state from samples that were under way before.
"""

from __future__ import annotations

import re

HANGS = "the pendulum hangs at rest in the middle of the rail"
_STAMP = re.compile(r"stamped (\d+)\.(\d{9}) s$")


def format_answer(stamp_ns: int | None) -> str:
    """Return the answer; None: the start state has no sample of its own."""
    if stamp_ns is None:
        return HANGS
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return f"{HANGS}; its sample is stamped {seconds}.{nanoseconds:09d} s"


def parse_stamp(answer: str) -> int | None:
    """Return the stamp (ns) of the start state's sample, None when the answer does not tell it."""
    found = _STAMP.search(answer)
    return None if found is None else int(found[1]) * 10**9 + int(found[2])

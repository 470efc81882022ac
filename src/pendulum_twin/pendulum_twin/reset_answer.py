"""Format and read a twin's answer to a reset.

In lockstep the sentence ends with the stamp of the start state's sample. Sample and answer arrive
in any order; the stamp separates the start state from samples that were under way before.
"""

from __future__ import annotations

import re

HANGS = "the pendulum hangs at rest in the middle of the rail"
_STAMP = re.compile(r"stamped (\d+)\.(\d{9}) s$")


def format_answer(stamp_ns: int | None) -> str:
    """Return the answer; stamp_ns: None when the start state has no sample of its own."""
    if stamp_ns is None:
        return HANGS
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return f"{HANGS}; its sample is stamped {seconds}.{nanoseconds:09d} s"


def parse_stamp(answer: str) -> int | None:
    """Return the stamp of the start state's sample, ns; None for an answer without it."""
    match = _STAMP.search(answer)
    return None if match is None else int(match[1]) * 10**9 + int(match[2])

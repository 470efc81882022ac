"""The sentence that answers a reset, and the stamp in it."""

import pytest

from pendulum_twin.reset_answer import HANGS, format_answer, parse_stamp


@pytest.mark.parametrize("stamp_ns", [0, 5, 10**9, 12_340_000_000, 10**18 + 1])
def test_the_answer_to_a_reset_tells_the_stamp(stamp_ns: int) -> None:
    assert parse_stamp(format_answer(stamp_ns)) == stamp_ns and format_answer(stamp_ns).startswith(
        HANGS
    )


def test_the_answer_to_a_reset_in_real_time_tells_none() -> None:
    assert parse_stamp(format_answer(None)) is None

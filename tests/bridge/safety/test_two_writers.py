"""Two simultaneous writers are detected by their numbers; a single writer never is."""

from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.safety.two_writers import TOGETHER_S, Writers, has_two_writers, hear_writer

PERIOD_S = 0.01
NOBODY = Writers()


def find_two(
    numbers: list[int],
    period_s: float = PERIOD_S,
    writers: Writers = NOBODY,
    start_s: float = 0.0,
) -> list[bool]:
    """Hear a message each period; return after each whether there are two writers."""
    answers = []
    for k, number in enumerate(numbers):
        now_s = start_s + k * period_s
        writers = hear_writer(number, now_s, writers)
        answers.append(has_two_writers(writers, now_s))
    return answers


def alternating(first: int, second: int, count: int = 20) -> list[int]:
    return [number for k in range(count) for number in (first + k, second + k)]


@given(st.lists(st.integers(1, 50), min_size=1), st.floats(0.0001, 10.0))
def test_one_writer_is_one_however_many_messages_are_lost(
    steps: list[int], period_s: float
) -> None:
    numbers = [sum(steps[: k + 1]) for k in range(len(steps))]
    assert not any(find_two(numbers, period_s))


@given(st.integers(1, 10**6), st.integers(1, 10**6))
def test_one_after_another_is_one_at_a_time(first: int, second: int) -> None:
    assert not any(find_two([first + k for k in range(30)] + [second + k for k in range(30)]))


@given(st.integers(1, 10**6), st.integers(1, 10**6))
def test_two_in_turn_are_found_with_the_second_message_of_each(first: int, second: int) -> None:
    answers = find_two(alternating(first, second))
    assert not any(answers[:2]) and all(answers[3:])
    assert (
        answers[2] or second >= first
    )  # the first's next number is as good as the second's only then


@given(
    st.integers(1, 10**6),
    st.integers(1, 10**6),
    st.integers(2, 20),
    st.randoms(use_true_random=False),
)
def test_two_at_any_rates_are_found(first: int, second: int, every: int, random) -> None:
    numbers = []
    for k in range(4 * every):
        numbers.append(first + k)
        if k % every == 0:
            numbers.append(second + k // every)
    assert any(find_two(numbers))


def test_it_ends_when_one_has_been_silent_for_long_enough() -> None:
    writers = Writers()
    for k, number in enumerate(alternating(1000, 1)):
        writers = hear_writer(number, k * PERIOD_S, writers)
    last_s, number = 40 * PERIOD_S, 1020
    times = [last_s + k * PERIOD_S for k in range(80)]
    answers = []
    for k, now_s in enumerate(times):
        writers = hear_writer(number + k, now_s, writers)
        answers.append(has_two_writers(writers, now_s))
    assert answers == sorted(answers, reverse=True)  # it ends once
    assert abs(answers.count(True) * PERIOD_S - TOGETHER_S) < 2 * PERIOD_S


def test_two_that_take_long_turns_are_not_at_the_same_time() -> None:
    assert not any(find_two(alternating(1000, 1), period_s=1.1 * TOGETHER_S))
    assert find_two(alternating(1000, 1), period_s=0.4 * TOGETHER_S)[-1]


def test_with_nobody_there_are_not_two() -> None:
    assert not has_two_writers(Writers(), 0.0)

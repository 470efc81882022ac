"""Samples wait for the commands that were said before them, and not for ever."""

from pendulum_bridge.watch.in_order import LONGEST_WAIT_NS, InOrder, Said


def said(*times_ns: int) -> list[Said]:
    return [Said(0, time_ns, (0.0, 3.0)) for time_ns in times_ns]


def test_samples_wait_for_a_later_command() -> None:
    order, samples = InOrder(), said(10, 20, 30)
    for sample in samples:
        order.sample(sample)
    assert list(order.due()) == []
    order.command(25)
    assert list(order.due()) == samples[:2]
    order.command(30)
    assert list(order.due()) == samples[2:] and list(order.due()) == []


def test_a_sample_that_comes_after_its_commands_is_due_at_once() -> None:
    order, (sample,) = InOrder(), said(10)
    order.command(12)
    order.sample(sample)
    assert list(order.due()) == [sample]


def test_without_commands_samples_wait_a_while() -> None:
    order, samples = InOrder(), said(0, LONGEST_WAIT_NS, LONGEST_WAIT_NS + 1)
    for sample in samples:
        order.sample(sample)
    assert list(order.due()) == samples[:1]

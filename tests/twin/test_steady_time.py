"""An even clock, whatever happens to the system's clock."""

from itertools import pairwise

from pendulum_twin.steady_time import FOLLOWED_NS, SteadyTime

PERIOD_NS, SET_NS = 10_000_000, 3_600 * 10**9


def test_stamps_are_even_until_the_clock_is_set() -> None:
    now, apart = [0], [5 * 10**18]
    clock = SteadyTime(lambda: now[0], lambda: now[0] + apart[0])
    stamps = []
    for k in range(30):
        now[0] = k * PERIOD_NS
        if k == 10:
            apart[0] -= SET_NS
        apart[0] += FOLLOWED_NS // 100  # it drifts
        assert clock.read_ns() == now[0]
        stamps.append(clock.to_stamp(now[0]))
    steps = [b - a for a, b in pairwise(stamps)]
    assert steps.pop(9) - PERIOD_NS + SET_NS < FOLLOWED_NS
    assert set(steps) == {PERIOD_NS}

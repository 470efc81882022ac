"""An even clock, whatever happens to the system's clock."""

from itertools import pairwise

import pytest

from pendulum_twin.steady_time import FOLLOWED_NS, SteadyTime

PERIOD_NS, SET_NS = 10_000_000, 3_600 * 10**9
STILL_NS = 50_000_000


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


@pytest.mark.parametrize("times", [1, 100])
@pytest.mark.parametrize("at", [0, 10])
def test_a_computer_that_stands_still_between_the_clocks_moves_no_stamp(
    at: int, times: int
) -> None:
    """The second clock is read late, once or again and again: that is no clock that was set."""
    now, stands = [0], []

    def read_system() -> int:
        system = now[0] + SET_NS
        now[0] += stands.pop() if stands else 0
        return system

    stands += [] if at else [STILL_NS]
    clock = SteadyTime(lambda: now[0], read_system)
    stamps = []
    for k in range(30):
        stands[:] = [STILL_NS] * times if k == at else []
        stamps.append(clock.to_stamp(k * PERIOD_NS))
    assert stamps == [SET_NS + k * PERIOD_NS for k in range(30)]

"""The table of faults (`make faults` prints it), each with its oracle, on the real programs."""

from collections.abc import Callable, Iterator

import pytest

pytest.importorskip("rclpy")
from faults import apart, catalogue
from faults.bench import Bench
from faults.row import Row
from support.ros_graph import Graph, graph

pytestmark = pytest.mark.wall_time  # each row says how long it takes until PWM is 0


@pytest.fixture(scope="module")
def bench() -> Iterator[Bench]:
    """Give one driver and one rig to all faults after which they have to go on."""
    with graph() as ros:
        made = Bench(ros)
        yield made
        made.close()


@pytest.mark.parametrize("fault", catalogue.ON_BENCH, ids=lambda fault: fault.__name__)
def test_fault(bench: Bench, fault: Callable[[Bench], Row]) -> None:
    bench.ready()
    row = fault(bench)
    print(row)
    assert row.right


@pytest.mark.parametrize("fault", catalogue.APART, ids=lambda fault: fault.__name__)
def test_fault_with_a_bench_of_its_own(ros: Graph, fault: Callable[[Graph], Row]) -> None:
    row = fault(ros)
    print(row)
    assert row.right


def test_the_systems_clock_is_set() -> None:
    assert apart.system_clock_jumps().right

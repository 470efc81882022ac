"""A live twin in the test's own process, served by threads of its own."""

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread

from rclpy.parameter import Parameter
from ros_graph import Graph

from pendulum_twin.nodes.twin_node import TwinNode, serve


@contextmanager
def served_twin(ros: Graph, namespace: str = "", **values: object) -> Iterator[TwinNode]:
    """Run a twin in a namespace, with these parameters."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    twin, stopped = TwinNode(context=ros.context, namespace=namespace, parameter_overrides=parameters), Event()
    thread = Thread(target=serve, args=(twin, stopped))
    thread.start()
    try:
        yield twin
    finally:
        stopped.set()
        thread.join()
        twin.destroy_node()

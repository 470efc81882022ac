"""A node, above all a live twin, in the test's own process, served by a thread of its own."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from rclpy.node import Node
from rclpy.parameter import Parameter

from pendulum_twin.nodes.twin_node import TwinNode, serve
from support.ros_graph import Graph


@contextmanager
def served[N: Node](node: N, serve: Callable[[N, Event], object]) -> Iterator[N]:
    """Serve a node until the end of the `with`, which destroys it."""
    stopped = Event()
    thread = Thread(target=serve, args=(node, stopped))
    thread.start()
    try:
        yield node
    finally:
        stopped.set()
        thread.join()
        node.destroy_node()


@contextmanager
def served_twin(ros: Graph, namespace: str = "", **values: object) -> Iterator[TwinNode]:
    """Run a twin in a namespace, with these parameters."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    with served(
        TwinNode(context=ros.context, namespace=namespace, parameter_overrides=parameters), serve
    ) as twin:
        yield twin

"""A ROS graph for a test: a domain of its own, nodes spun in process, programs started beside."""

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import rclpy
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from pendulum_twin.nodes.transport import PROFILES, RANGE, leave_shared_memory
from support.polling import DEADLINE_S, until

CLIENTS = 4  # tried in turn for a service that no client sees
DOMAINS = range(1, 100)  # higher ones need ports that the system gives to others


@contextmanager
def free_domain() -> Iterator[int]:
    """Take a domain that no other test on this machine has now."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for domain in DOMAINS:
            with suppress(OSError):
                claim.bind(f"\0pendulum-test-domain-{domain}")
                break
        else:
            raise AssertionError("no free ROS domain")
        yield domain


class Graph:
    """Nodes in this process, served by one executor, and programs in the same domain."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = SingleThreadedExecutor(context=self.context)
        self._nodes: list[Node] = []
        self._programs: list[subprocess.Popen] = []

    def add(self, make: Callable[..., Node], /, namespace: str = "", **parameters: Any) -> Any:
        """Make a node with parameters and serve it from now on."""
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        node = make(context=self.context, namespace=namespace, parameter_overrides=overrides)
        return self.serve(node)

    def user(self, name: str = "user", namespace: str = "") -> Node:
        """Make a plain node that the test publishes and listens with."""
        return self.serve(Node(name, namespace=namespace, context=self.context))

    def serve(self, node: Node) -> Node:
        self._nodes.append(node)
        self.executor.add_node(node)
        return node

    def remove(self, node: Node) -> None:
        self._nodes.remove(node)
        self.executor.remove_node(node)
        node.destroy_node()

    def spin(self) -> None:
        self.executor.spin_once(timeout_sec=0.02)

    def until(self, done: Callable[[], Any], what: str, deadline_s: float = DEADLINE_S) -> Any:
        """Spin until done returns something true, and return that; fail at the deadline."""
        return until(done, what, self.spin, deadline_s)

    def call(self, client: Client, request: Any = None, deadline_s: float = DEADLINE_S) -> Any:
        """Call a service (a Trigger unless a request is given) and return its answer."""
        client = self._make_ready(client, deadline_s)
        answer = client.call_async(Trigger.Request() if request is None else request)
        self.until(answer.done, f"the answer of {client.srv_name}", deadline_s)
        return answer.result()

    def _make_ready(self, client: Client, deadline_s: float) -> Client:
        """Return a client that sees its service: a new client where the given client does not.

        On a busy machine the middleware may lose a match of client and service for ever, and the
        match of the next client, too.
        """
        for _ in range(CLIENTS):
            with suppress(AssertionError):
                self.until(client.service_is_ready, client.srv_name, deadline_s / CLIENTS)
                return client
            client = self._nodes[-1].create_client(client.srv_type, client.srv_name)
        self.until(client.service_is_ready, client.srv_name, deadline_s)
        return client

    def start(self, module: str, *arguments: object) -> subprocess.Popen:
        """Start a node's module as a program in this domain; killed at the end of the test."""
        command = [sys.executable, "-m", module, *map(str, arguments)]
        program = subprocess.Popen(
            command,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._programs.append(program)
        return program

    @property
    def environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "ROS_DOMAIN_ID": str(self.domain),
            "PYTHONPATH": os.pathsep.join(sys.path),
        }

    def close(self) -> None:
        for program in self._programs:
            program.kill()
            program.communicate()
        self.executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        self.context.try_shutdown()


@contextmanager
def graph() -> Iterator[Graph]:
    """Return a graph in a domain of its own; the fixture `ros` of the tests."""
    before = dict(os.environ)
    os.environ[RANGE] = "LOCALHOST"
    leave_shared_memory()
    try:
        with free_domain() as domain:
            made = Graph(domain)
            try:
                yield made
            finally:
                made.close()
    finally:
        for name in (RANGE, PROFILES):
            os.environ.pop(name, None)
            if name in before:
                os.environ[name] = before[name]

"""Run a node as a program: arguments, signals, exit status, and errors in one sentence."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from pendulum_twin.errors import ReportedError
from pendulum_twin.nodes.overrides import check_parameter_files, list_parameter_files
from pendulum_twin.nodes.settings import describe_settings
from pendulum_twin.nodes.transport import leave_shared_memory
from pendulum_twin.parser import Parser, add_common_options, complete
from pendulum_twin.stop_request import StopRequest, catch_stop_signals, ignore_stop_signals

LONGEST_WAIT_S = 0.2  # until a signal is seen


def spin(node: Node, stopped: StopRequest, over: Callable[[], bool] = lambda: False) -> None:
    """Serve a node's callbacks until it is stopped or done.

    stopped: ends it when it is set.
    over: returns whether the node is done by itself.
    """
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        while not stopped.is_set() and not over():
            executor.spin_once(timeout_sec=LONGEST_WAIT_S)
    finally:
        executor.shutdown()


def run[N: Node](
    name: str,
    description: str,
    settings: type[Any],
    make: Callable[[], N],
    arguments: list[str] | None = None,
    serve: Callable[[N, StopRequest], str | None] = spin,
    prepare: Callable[[str, StopRequest], bool] = lambda name, stopped: True,
) -> int:
    """Make a node and serve it until SIGINT or SIGTERM, or until `serve` ends by itself.

    name: of the program: that of its node with _node behind it.
    description: what it does, for --help.
    settings: dataclass of the node's parameters, with EXAMPLES, command lines for --help.
    make: returns the node.
    arguments: command line with the program's name; None for that of the process.
    serve: serves the node and returns why it failed, or None.
    prepare: takes the program's name and the event of a signal, does what takes long before the
        node is made, and returns False when a signal has ended it.

    Returns the exit status: 0; 1 with a sentence on stderr when a setting is wrong, ROS cannot run
    or `serve` failed; 2 for wrong use. The node is destroyed at the end in any case; its last
    actions belong in its `destroy_node`.
    """
    arguments = sys.argv if arguments is None else arguments
    try:
        parser = make_node_parser(name, description, settings)
        complete(parser)
        options = parser.parse_args(remove_ros_args(arguments)[1:])
        # rclpy's own handlers would raise in the middle of a callback, or of the start
        stopped = catch_stop_signals()
        if not prepare(name, stopped):
            return 0
        quieting = ["--ros-args", "--log-level", "warn"] if options.quiet else []
        leave_shared_memory()
        rclpy.init(args=[*arguments, *quieting], signal_handler_options=SignalHandlerOptions.NO)
        if list_parameter_files(arguments):  # before the node opens or writes anything
            check_parameter_files(_find_full_name(name), arguments)
        node = make()
        try:
            failure = serve(node, stopped)
        finally:
            node.destroy_node()
    except ReportedError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1
    except (RCLInvalidROSArgsError, UnknownROSArgsError) as error:
        hint = _hint_at_empty_value(arguments)
        print(f"{name}: wrong --ros-args: {str(error).splitlines()[0]}{hint}", file=sys.stderr)
        return 2
    except RuntimeError as error:  # rclpy raises it for a bad name, or no middleware
        print(f"{name}: ROS cannot run it: {str(error).splitlines()[0]}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
        if arguments is sys.argv:  # the program ends: a second Ctrl-C must not change how
            ignore_stop_signals()
    if failure is not None:
        print(f"{name}: {failure}", file=sys.stderr)
    return 0 if failure is None else 1


def _find_full_name(program: str) -> str:
    """Return the full name of a program's node, as the command line renames and places it."""
    probe = Node(
        program.removesuffix("_node"), enable_rosout=False, start_parameter_services=False
    )
    try:
        return str(probe.get_fully_qualified_name())
    finally:
        probe.destroy_node()


def _hint_at_empty_value(arguments: Sequence[str]) -> str:
    """Return how an empty value is written, where an argument has nothing after its := sign.

    A shell takes the quotes of -p NAME:='' away, and ROS refuses what is left.
    """
    empty = next((word for word in arguments if word.endswith(":=")), "")
    return f"; an empty text is written -p \"{empty}''\"" if empty else ""


def make_node_parser(name: str, description: str, settings: type[Any]) -> Parser:
    """Return the parser of a node's program: its parameters, examples and common options."""
    how = "--ros-args -p NAME:=VALUE; an empty text: -p \"NAME:=''\""
    parameters = f"Parameters ({how}):\n{describe_settings(settings)}"
    parser = Parser(
        prog=name, description=f"{description}\n\n{parameters}", examples=settings.EXAMPLES
    )
    add_common_options(parser)
    return parser

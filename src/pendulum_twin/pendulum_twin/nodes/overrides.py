"""Refuse parameters that nobody reads: a misspelt limit would leave the default in force.

ROS drops an override whose name no node declares, and a section of a parameter file whose node
name matches no node, without a word.
"""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import yaml
from rclpy.node import Node

from pendulum_twin.errors import BadInputError

VALUES = "ros__parameters"  # the key under a node's name in a parameter file
OPTION = "--params-file"


def check_overrides(node: Node) -> None:
    """Raise BadInputError when a parameter was given that the node has not declared.

    The node must have declared all its parameters.
    """
    for name in node._parameter_overrides:
        if not node.has_parameter(name):
            declared = list(node._parameters)
            nearest = difflib.get_close_matches(name, declared, 1)
            hint = f"; the nearest name is {nearest[0]}" if nearest else ""
            raise BadInputError(
                f"{name}: expected a parameter of {node.get_fully_qualified_name()}, "
                f"found none of this name{hint}"
            )


def check_parameter_files(name: str, arguments: Sequence[str]) -> None:
    """Raise BadInputError when a parameter file of the command line says nothing to a node.

    name: the node's, in full.
    arguments: the command line. rclpy has read the files before, so that they are well formed.
    """
    for path in list_parameter_files(arguments):
        try:  # bytes, for rclpy reads UTF-16, too
            patterns = list(_list_patterns(yaml.safe_load(Path(path).read_bytes())))
        except (UnicodeDecodeError, yaml.YAMLError) as error:
            raise BadInputError(
                f"{path}: expected parameters as YAML, found something else: save it as UTF-8"
            ) from error
        if not any(_matches(pattern, name) for pattern in patterns):
            sections = f"only {', '.join(patterns)}" if patterns else "none"
            raise BadInputError(
                f"{path}: expected parameters of {name}, found {sections}: "
                "name the node so, or write /** for every node"
            )


def list_parameter_files(arguments: Sequence[str]) -> list[str]:
    """Return the paths of the parameter files that a command line names."""
    return [value for option, value in itertools.pairwise(arguments) if option == OPTION]


def _list_patterns(section: Any, name: str = "") -> Iterator[str]:
    """Yield the node names of a parameter file, a pattern each, with a leading slash."""
    if not isinstance(section, dict):
        return
    for key, below in section.items():
        if key == VALUES:
            yield name
        else:
            yield from _list_patterns(below, f"{name}/{str(key).strip('/')}")


def _matches(pattern: str, name: str) -> bool:
    """Tell whether a pattern matches a node's name: * is a part of it, ** any number of parts.

    A name without a namespace matches the node of this name in the root alone, as in rcl.
    """
    tokens = {"/**": "(/[^/]+)*", "/*": "/[^/]+"}
    parts = re.split(r"(/\*\*|/\*)", pattern)
    return (
        re.fullmatch("".join(tokens.get(part, re.escape(part)) for part in parts), name)
        is not None
    )

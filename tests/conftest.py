"""Fixtures for every folder."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def ros() -> Iterator[Any]:
    """Give a ROS graph of its own (`ros_graph.Graph`)."""
    pytest.importorskip("rclpy")
    from support.ros_graph import graph

    with graph() as made:
        yield made

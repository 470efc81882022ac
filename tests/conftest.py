"""Fixtures for every folder."""

from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# A slow machine makes no example wrong.
settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("patient")


@pytest.fixture
def ros() -> Iterator[Any]:
    """Give a ROS graph of its own (`ros_graph.Graph`)."""
    pytest.importorskip("rclpy")
    from support.ros_graph import graph

    with graph() as made:
        yield made

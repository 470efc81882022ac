"""Fixtures for every folder."""

import gc
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from support.signals import restore_interrupt

# a machine may stand still for seconds; every run draws the same examples
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")


def pytest_configure() -> None:
    restore_interrupt()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without the search for garbage: a fifth of the time, and all imports stay."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no file without the marker where `-m wall_time` asks for marked tests alone."""
    alone = config.option.markexpr == "wall_time" and collection_path.suffix == ".py"
    return True if alone and "wall_time" not in collection_path.read_text("utf-8") else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the longest tests begin first, so that parallel processes end together."""
    items.sort(key=_get_seconds, reverse=True)


def _get_seconds(item: pytest.Item) -> float:
    """Return how long a test takes, as its marker says, s; 0 for a test that is not long."""
    long = item.get_closest_marker("long")
    return 0.0 if long is None else float(long.kwargs.get("seconds", 10.0))


@pytest.fixture
def ros() -> Iterator[Any]:
    """Give a ROS graph of its own (`ros_graph.Graph`)."""
    pytest.importorskip("rclpy")
    from support.ros_graph import graph

    with graph() as ros_graph:
        yield ros_graph

"""The first start says that it compiles, hears signals meanwhile, and leaves nothing behind."""

import signal
import threading

import pytest

pytest.importorskip("rclpy")
from support.ros_graph import Graph

from pendulum_twin import compile_ahead
from pendulum_twin.motion import LAW_SETS

MODULE = "pendulum_twin.nodes.twin_node"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_cold_start_can_be_interrupted(ros: Graph, monkeypatch, tmp_path, number) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    node = ros.start(MODULE, "--ros-args", "-p", "twin:=anything.yaml")
    assert node.stderr.readline() == "twin_node: compiling the twin once (about 15 s)\n"
    assert node.stderr.readline() == f"twin_node: compiling for live: 1 of {2 + len(LAW_SETS)}\n"
    node.send_signal(number)
    _, said = node.communicate(timeout=60)
    assert node.returncode == 0 and "Traceback" not in said
    assert "anything.yaml" not in said, "it went on"
    assert not list(tmp_path.rglob("compiled-*"))


def test_what_is_compiled_is_not_compiled_again(monkeypatch, tmp_path, capsys) -> None:
    mark = tmp_path / "compiled"
    mark.touch()
    monkeypatch.setattr(compile_ahead, "_find_mark", lambda what: mark)
    assert compile_ahead.prepare_kernel("twin_node", threading.Event())
    assert capsys.readouterr().err == ""


def test_a_machine_without_a_place_for_machine_code_goes_on(monkeypatch, capsys) -> None:
    monkeypatch.setattr(compile_ahead, "_find_mark", lambda what: None)
    assert compile_ahead.prepare_kernel("twin_node", threading.Event())
    assert capsys.readouterr().err == ""


def test_a_child_that_fails_holds_nothing_up(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(compile_ahead, "_find_mark", lambda what: tmp_path / "never")
    monkeypatch.setattr(compile_ahead, "MODULE", "no.such.module")
    assert compile_ahead.prepare_kernel("twin_node", threading.Event())

"""The program of a node: --quiet leaves out what is only information."""

import pytest

pytest.importorskip("rclpy")

from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes import running
from pendulum_twin.nodes.twin_settings import TwinSettings


@pytest.mark.parametrize(
    ("options", "more"), [([], []), (["--quiet"], ["--ros-args", "--log-level", "warn"])]
)
def test_quiet_raises_the_level_of_the_log(
    options: list[str],
    more: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    given: list[list[str]] = []

    def note(args: list[str], **_: object) -> None:
        given.append(args)
        raise BadInputError("no graph in this test")

    monkeypatch.setattr(running.rclpy, "init", note)
    monkeypatch.setattr(running, "catch_stop_signals", lambda: None)
    words = ["twin_node", *options, "--ros-args", "-p", "twin:=rig.yaml"]
    assert running.run("twin_node", "A twin.", TwinSettings, lambda: None, words) == 1
    assert given == [[*words, *more]]
    assert capsys.readouterr().err == "twin_node: no graph in this test\n"

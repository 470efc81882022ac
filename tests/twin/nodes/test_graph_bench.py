"""The benchmark of the graph runs and prints its table; the figures are not judged here."""

import subprocess
import sys

import pytest
from support.paths import ROOT

pytest.importorskip("rclpy")
BENCH = ROOT / "tests" / "bench" / "graph.py"


@pytest.mark.long
def test_it_prints_a_row_for_each_figure() -> None:
    command = [sys.executable, str(BENCH), "--steps", "20", "--jitter", "0.5"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert ended.returncode == 0, ended.stderr
    for figure in (
        "two processes",
        "two threads",
        "one thread",
        "|interval - 10 ms|",
        "|published - stamp|",
        "p50",
        "p99",
        "max",
    ):
        assert figure in ended.stdout
    assert ended.stdout.count("bare") == 9

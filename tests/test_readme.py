"""Every command of the README runs, in order, in a real shell, and ends with status 0."""

import os
import random
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.built_packages import assert_colcon_install
from support.made_recordings import HANGING, INTECO, made
from support.paths import ROOT

pytestmark = pytest.mark.long(seconds=200)

README = (ROOT / "README.md").read_text(encoding="utf-8")
LEFT_BEHIND = shutil.ignore_patterns(
    ".venv*",
    ".git",
    "build",
    "install",
    "log",
    "out",
    "*.egg-info",
    "__pycache__",
    ".*_cache",
    ".hypothesis",
)
NOT_RUN = ("git clone ",)  # there is no place yet to clone from
ONLY_PRINTED = re.compile(
    r"make (setup|test|check|bench)\b"
)  # they would set up, or test, within a test
SHORTER = {
    "--timesteps 100000": "--timesteps 4000",  # the test waits for no good policy
    "--effects 2": "--effects 2 --plan short_plan.yaml",  # nor does a minute pass in real time
}
SHORT_PLAN = """
schema: pendulum_plan/1
phases:
  - {kind: push}
  - {kind: chirp, seconds: 10, from_hz: 0.3, to_hz: 3, amplitude: 0.3}
  - {kind: steps, seconds: 6, amplitude: 0.4, seed: 1}
  - {kind: rest, seconds: 2, centred: true}
"""
STARTED = re.compile(r"\]: twin .* runs at .* Hz")
LONGEST_S = 1200.0  # of one command: a slow machine takes minutes


def commands(text: str) -> list[str]:
    """Return the commands of all `sh` blocks, one a line; a backslash continues a line."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    lines = "".join(blocks).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.strip() and not line.startswith("#")]


def environment() -> dict[str, str]:
    """Return the environment of a user's shell, without the tests' venv, in its own ROS domain."""
    kept = {
        k: v
        for k, v in os.environ.items()
        if k not in ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "VIRTUAL_ENV", "PYTHONPATH")
    }
    if "_ROS_WHEELS_BOOTSTRAP_COMPLETE" in os.environ:
        kept.pop("LD_LIBRARY_PATH", None)
    return kept | {
        "ROS_DOMAIN_ID": str(random.SystemRandom().randrange(20, 100)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "PYTHONUNBUFFERED": "1",
    }


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """Return a copy of the workspace, with the venv of the original and a CSV file of a run."""
    copy = tmp_path / "pendulum"
    shutil.copytree(ROOT, copy, ignore=LEFT_BEHIND)
    (copy / ".venv").symlink_to(sys.prefix)
    up_to_date = subprocess.run(
        ["make", "--question", "setup"], cwd=copy, env=environment(), check=False
    )
    assert up_to_date.returncode == 0, (
        "the venv that runs the tests is not what `make setup` makes: run `make setup`"
    )
    (copy / "short_plan.yaml").write_text(SHORT_PLAN, encoding="utf-8")
    signals = made(INTECO, seconds=20.0).signals
    rows = zip(signals.command, signals.cart, signals.pole - HANGING[1], strict=True)
    lines = [
        f"{k * signals.period_s:.6f},{u:.9f},{x:.9f},{th:.9f}\n"
        for k, (u, x, th) in enumerate(rows)
    ]
    (copy / "run.csv").write_text("t,volts,x,theta\n" + "".join(lines), encoding="utf-8")
    return copy


def run_to_its_end(command: str, where: Path) -> None:
    shell = ["bash", "-euo", "pipefail", "-c", command]
    done = subprocess.run(
        shell,
        cwd=where,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )
    assert done.returncode == 0, (
        f"{command}\nended with {done.returncode}\n{done.stdout}\n{done.stderr}"
    )


def run_until_it_is_stopped(command: str, where: Path) -> None:
    """Start a node, wait until it runs, interrupt it, and check that it ends well."""
    shell = ["bash", "-c", command]
    node = subprocess.Popen(
        shell,
        cwd=where,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        bufsize=0,
        start_new_session=True,
    )
    try:
        said = said_until(STARTED, node)
        assert STARTED.search(said), f"{command}\n{said}"
        os.killpg(node.pid, signal.SIGINT)
        last_words, _ = node.communicate(timeout=LONGEST_S)
        assert node.returncode == 0, f"{command}\n{said}{last_words.decode()}"
    finally:
        if node.poll() is None:
            os.killpg(node.pid, signal.SIGKILL)
            node.communicate()


def said_until(words: re.Pattern[str], node: subprocess.Popen[bytes]) -> str:
    """Return what a program says until it says these words, ends, or has taken too long."""
    assert node.stdout is not None
    said, end = b"", time.monotonic() + LONGEST_S
    while not words.search(said.decode(errors="replace")):
        ready, _, _ = select.select([node.stdout], [], [], max(end - time.monotonic(), 0.0))
        part = node.stdout.read(65536) if ready else b""
        if not part:
            break
        said += part
    return said.decode(errors="replace")


def shorten(command: str) -> str:
    """Return the command as a test runs it: it does the same in less time."""
    for long, short in SHORTER.items():
        command = command.replace(long, short)
    return command


def test_every_command_of_the_readme_runs(workspace: Path) -> None:
    """What `make colcon` installs there is whole, too: see `test_packaging.py`."""
    to_run = [command for command in commands(README) if not command.startswith(NOT_RUN)]
    assert len(to_run) >= 10
    assert all(any(long in command for command in to_run) for long in SHORTER)
    for command in map(shorten, to_run):
        if "ros2 run" in command and shutil.which("ros2") is None:
            command = command.replace(
                "ros2 run pendulum_twin twin_node",
                "install/pendulum_twin/lib/pendulum_twin/twin_node",
            )
        if ONLY_PRINTED.match(command):
            run_to_its_end(ONLY_PRINTED.sub(r"make --dry-run \1", command), workspace)
        elif "twin_node" in command:
            run_until_it_is_stopped(command, workspace)
        else:
            run_to_its_end(command, workspace)
    assert_colcon_install(workspace / "install")


def test_commands_are_read_as_a_shell_reads_them() -> None:
    text = "```sh\n# why\nmake demo\nsysid \\\n  effects\n\n```\n"
    text += "```text\nnot run\n```\n```sh\nmake test\n```\n"
    assert commands(text) == ["make demo", "sysid    effects", "make test"]


def test_the_readme_is_short() -> None:
    assert len(README.splitlines()) < 150

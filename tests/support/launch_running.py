"""Start the programs of a launch file, as `ros2 launch` would; all end with a vital program."""

from __future__ import annotations

import ast
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import yaml

from support.launch_files import SRC, Launch, Process

LONGEST_S = 180.0
OURS = ("pendulum_twin", "pendulum_bridge")


def executables(package: str) -> dict[str, str]:
    """Return what a package's setup.py makes: name -> module:function."""
    for node in ast.parse((SRC / package / "setup.py").read_text(encoding="utf-8")).body:
        if (
            isinstance(node, ast.Assign)
            and isinstance(node.targets[0], ast.Name)
            and node.targets[0].id == "EXECUTABLES"
        ):
            return ast.literal_eval(node.value)
    raise AssertionError(f"{package}: setup.py has no EXECUTABLES")


def command(process: Process, folder: Path) -> list[str]:
    """Return the command line of a program of ours; mappings of parameters become files."""
    module = executables(process.package)[process.executable].split(":")[0]
    line = [sys.executable, "-m", module, *process.arguments]
    if not process.is_node:
        return line
    line += ["--ros-args", "-r", f"__ns:={process.namespace}"]
    line += ["-r", f"__node:={process.name}"] if process.name else []
    for k, values in enumerate(process.parameters):
        file = (
            values
            if isinstance(values, Path)
            else _written(values, folder / f"{process.executable}_{k}.yaml")
        )
        line += ["--params-file", str(file)]
    return line


def _written(parameters: dict[str, Any], file: Path) -> Path:
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}), encoding="utf-8")
    return file


class Running:
    """Programs that were started together."""

    def __init__(self, launch: Launch, environment: dict[str, str], folder: Path) -> None:
        self._folder = folder
        self._programs: list[tuple[Process, subprocess.Popen]] = []
        try:
            for k, process in enumerate(launch.processes):
                place = folder / f"{k}_{process.executable}"
                place.mkdir(parents=True)
                with (place / "log").open("w") as log:
                    line = command(process, place)
                    program = subprocess.Popen(
                        line, env=environment, stdout=log, stderr=subprocess.STDOUT
                    )
                self._programs.append((process, program))
        except BaseException:
            self.kill()
            raise

    def over(self) -> str:
        """Return the name of a program that ended and ends all with it; nothing while all live."""
        return next(
            (
                p.executable
                for p, program in self._programs
                if p.ends_all and program.poll() is not None
            ),
            "",
        )

    def end(self) -> dict[str, int]:
        """Interrupt all that still run, as launch does, and return the exit status of each."""
        for _, program in self._programs:
            if program.poll() is None:
                program.send_signal(signal.SIGINT)
        end = time.monotonic() + LONGEST_S
        with suppress(subprocess.TimeoutExpired):
            for _, program in self._programs:
                program.wait(max(0.0, end - time.monotonic()))
        return {process.executable: program.poll() for process, program in self._programs}

    def said(self) -> str:
        return "\n".join(
            f"== {log.parent.name}\n{log.read_text()}"
            for log in sorted(self._folder.glob("*/log"))
        )

    def kill(self) -> None:
        for _, program in self._programs:
            program.kill()
            program.wait()


@contextmanager
def running(launch: Launch, environment: dict[str, str], folder: Path) -> Iterator[Running]:
    """Start a launch file's programs; kill them at the end, print their logs on a failure."""
    programs = Running(launch, {**environment, "PYTHONUNBUFFERED": "1"}, folder)
    try:
        yield programs
    except BaseException:
        print(programs.said())
        raise
    finally:
        programs.kill()

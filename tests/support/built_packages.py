"""What an installation of the four packages has to hold, whichever tool made it."""

import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

from support.paths import ROOT

PACKAGES = ["pendulum_bridge", "pendulum_rl_env", "pendulum_sysid", "pendulum_twin"]
SHARED = (
    "launch",
    "config",
    "rviz",
    "foxglove",
)  # folders of pendulum_bridge that launch files look for in its share


def run(*command: str | Path, **environment: str) -> str:
    """Run a command to its end and return its output; fail with both its streams."""
    done = subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, (
        f"{command} ended with {done.returncode}\n{done.stdout}\n{done.stderr}"
    )
    return done.stdout


def list_console_scripts(package: str) -> metadata.EntryPoints:
    """Return a package's executables, without its plug-ins for other libraries."""
    return metadata.distribution(package).entry_points.select(group="console_scripts")


def assert_executables(prefix: Path, package: str) -> None:
    """Check that lib/<package>/<name> is executable and hands its arguments to bin/<name>.

    The programs in bin/ are replaced by one that prints its arguments.
    """
    for script in list_console_scripts(package):
        wrapper, real = prefix / "lib" / package / script.name, prefix / "bin" / script.name
        assert os.access(real, os.X_OK), f"{real} is missing or not executable"
        assert os.access(wrapper, os.X_OK), f"{wrapper} is missing or not executable"
        real.write_text('#!/bin/sh\necho "$0" "$@"\n')
        assert run(wrapper, "one", "two words").split(" ", 1)[1] == "one two words\n"


def read_files(folder: Path) -> dict[str, bytes]:
    """Return name -> bytes of a folder's files, without folders such as __pycache__."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def assert_shared_files(prefix: Path) -> None:
    """Check that share/pendulum_bridge has every file of the folders that are shared."""
    for folder in SHARED:
        here, there = (
            ROOT / "src" / "pendulum_bridge" / folder,
            prefix / "share" / "pendulum_bridge" / folder,
        )
        files = read_files(here)
        assert files and read_files(there) == files


def assert_colcon_install(install: Path) -> None:
    """Check what colcon put into a folder: every package is found there, with its programs."""
    for package in PACKAGES:
        prefix = install / package
        assert (prefix / "share/ament_index/resource_index/packages" / package).is_file()
        assert (prefix / "share" / package / "package.xml").is_file()
        where = f'. "$0" && "$1" -c "import {package}; print({package}.__file__)"'
        setup = prefix / "share" / package / "package.sh"
        place = run("sh", "-c", where, setup, sys.executable, COLCON_CURRENT_PREFIX=str(prefix))
        assert str(install.parent) in place, (
            "sourcing the installed package leads to another copy of it"
        )
        assert_executables(prefix, package)
    assert_shared_files(install / "pendulum_bridge")


def copy_sources(to: Path) -> Path:
    """Copy src/, so that a build leaves nothing behind and sees no earlier build."""
    left_behind = shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
    return Path(shutil.copytree(ROOT / "src", to / "src", ignore=left_behind))

"""Hold what `pip install`, `colcon build` and `ros2 run` need of the four packages."""

import ast
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib import metadata
from pathlib import Path

import pytest
from support.paths import ROOT

PACKAGES = ["pendulum_bridge", "pendulum_rl_env", "pendulum_sysid", "pendulum_twin"]
ROS_IS_SOURCED = "AMENT_PREFIX_PATH" in os.environ and os.environ.get("ROS_DISTRO") == "jazzy"
LOCK = (ROOT / "requirements.lock").read_text().splitlines()
DEPEND_TAGS = ("depend", "exec_depend")
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


def console_scripts(package: str) -> metadata.EntryPoints:
    """Return a package's executables, without its plug-ins for other libraries."""
    return metadata.distribution(package).entry_points.select(group="console_scripts")


def normal(name: str) -> str:
    """Spell a distribution's name as package indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def package_xml(package: str) -> ET.Element:
    return ET.parse(ROOT / "src" / package / "package.xml").getroot()


def third_party_imports(package: str) -> set[str]:
    """Collect the first names of a package's imports, without its own and Python's.

    A study may import the other packages of the workspace, which no package requires.
    """
    names = set()
    for path in (ROOT / "src" / package / package).rglob("*.py"):
        imported = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                imported.add(str(node.module).split(".")[0])
        names |= imported - (set(PACKAGES) if "studies" in path.parts else {package})
    return names - sys.stdlib_module_names


SCRIPTS = [script for package in PACKAGES for script in console_scripts(package)]


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy src/, so that a build leaves nothing behind and sees no earlier build."""
    copy = tmp_path_factory.mktemp("workspace") / "src"
    shutil.copytree(
        ROOT / "src", copy, ignore=shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
    )
    return copy


def assert_executables(prefix: Path, package: str) -> None:
    """Check that lib/<package>/<name> is executable and hands its arguments to bin/<name>."""
    for script in console_scripts(package):
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


def test_lock_is_nothing_but_exact_versions() -> None:
    assert [
        line for line in LOCK if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.]+", line)
    ] == []
    assert len({normal(line.split("==")[0]) for line in LOCK}) == len(LOCK)


def test_lock_is_what_is_installed() -> None:
    pins = dict(line.split("==") for line in LOCK)
    if ROS_IS_SOURCED:  # a sourced ROS takes the place of its wheels
        pins = {name: version for name, version in pins.items() if not name.startswith("ros-")}
    assert {name: metadata.version(name) for name in pins} == pins


@pytest.mark.skipif(ROS_IS_SOURCED, reason="the system's packages are seen as well")
def test_lock_is_complete() -> None:
    alone = re.findall(r"^([\w-]+)==", (ROOT / "requirements.nodeps").read_text(), re.MULTILINE)
    asked = subprocess.run(
        [sys.executable, "-m", "pip", "check"], capture_output=True, text=True, check=False
    ).stdout
    missing = [
        line
        for line in asked.splitlines()
        if not line.startswith((*alone, "No broken requirements"))
    ]
    assert alone and missing == []


def test_there_is_an_executable() -> None:
    assert {script.name for script in SCRIPTS} >= {"twin_node", "sysid"}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_console_script_can_be_called(script: metadata.EntryPoint) -> None:
    assert callable(script.load())
    assert os.access(Path(sys.executable).parent / script.name, os.X_OK), "run `make setup`"


@pytest.mark.parametrize("package", PACKAGES)
def test_wrappers_are_one_a_script(package: str) -> None:
    wrappers = {path.name: path for path in (ROOT / "src" / package / "lib").glob("*")}
    assert set(wrappers) == {script.name for script in console_scripts(package)}
    assert all(os.access(path, os.X_OK) for path in wrappers.values())


@pytest.mark.parametrize("package", PACKAGES)
def test_package_xml(package: str) -> None:
    root = package_xml(package)
    assert (root.tag, root.get("format")) == ("package", "3")
    assert root.findtext("name") == package
    assert root.findtext("version") == metadata.version(package)
    assert root.findtext("export/build_type") == "ament_python"
    assert (ROOT / "src" / package / "resource" / package).is_file()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_import_is_declared(package: str) -> None:
    ros = {element.text for tag in DEPEND_TAGS for element in package_xml(package).iter(tag)}
    required = metadata.requires(package) or []
    pip = {normal(re.split(r"[^A-Za-z0-9._-]", line, maxsplit=1)[0]) for line in required}
    distributions = metadata.packages_distributions()
    undeclared = {
        name
        for name in third_party_imports(package) - ros
        if pip.isdisjoint(normal(distribution) for distribution in distributions.get(name, [name]))
    }
    assert undeclared == set(), (
        "add it to install_requires in setup.py, or, if ROS ships it, to package.xml"
    )


def test_pip_install(sources: Path, tmp_path: Path) -> None:
    options = [
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--use-pep517",
        "--ignore-installed",
    ]
    folders = [sources / package for package in PACKAGES]
    run(sys.executable, "-m", "pip", "install", *options, "--prefix", tmp_path, *folders)
    for package in PACKAGES:
        assert (tmp_path / "share/ament_index/resource_index/packages" / package).is_file()
        assert (tmp_path / "share" / package / "package.xml").is_file()
        assert_executables(tmp_path, package)
    assert_shared_files(tmp_path)


@pytest.mark.parametrize("options", [[], ["--symlink-install"]], ids=["copied", "symlinked"])
def test_colcon_build(sources: Path, tmp_path: Path, options: list[str]) -> None:
    colcon = Path(sys.executable).parent / "colcon"
    places = [f"--{place}={tmp_path / place}" for place in ("build-base", "install-base")]
    run(
        colcon,
        f"--log-base={tmp_path / 'log'}",
        "build",
        *places,
        "--base-paths",
        sources,
        *options,
    )
    for package in PACKAGES:
        prefix = tmp_path / "install-base" / package
        assert (prefix / "share/ament_index/resource_index/packages" / package).is_file()
        assert (prefix / "share" / package / "package.xml").is_file()
        where = f'. "$0" && "$1" -c "import {package}; print({package}.__file__)"'
        setup = prefix / "share" / package / "package.sh"
        found = run("sh", "-c", where, setup, sys.executable, COLCON_CURRENT_PREFIX=str(prefix))
        assert str(tmp_path) in found, "sourcing the installed package leads to another copy of it"
        assert_executables(prefix, package)
    assert_shared_files(tmp_path / "install-base" / "pendulum_bridge")

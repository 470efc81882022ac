"""Hold what `pip install`, `colcon build` and `ros2 run` need of the four packages."""

import ast
import functools
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

import pytest
from support.built_packages import (
    PACKAGES,
    assert_colcon_install,
    assert_executables,
    assert_shared_files,
    copy_sources,
    list_console_scripts,
    run,
)
from support.paths import ROOT

ROS_IS_SOURCED = "AMENT_PREFIX_PATH" in os.environ and os.environ.get("ROS_DISTRO") == "jazzy"
LOCK = (ROOT / "requirements.lock").read_text().splitlines()
DEPEND_TAGS = ("depend", "exec_depend")


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


@functools.cache
def list_distributions() -> Mapping[str, list[str]]:
    """Return importable name -> distributions: all that is installed is read once."""
    return metadata.packages_distributions()


SCRIPTS = [script for package in PACKAGES for script in list_console_scripts(package)]


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
    assert set(wrappers) == {script.name for script in list_console_scripts(package)}
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
    distributions = list_distributions()
    undeclared = {
        name
        for name in third_party_imports(package) - ros
        if pip.isdisjoint(normal(distribution) for distribution in distributions.get(name, [name]))
    }
    assert undeclared == set(), (
        "add it to install_requires in setup.py, or, if ROS ships it, to package.xml"
    )


def test_pip_install(tmp_path: Path) -> None:
    options = [
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "--use-pep517",
        "--ignore-installed",
    ]
    sources, prefix = copy_sources(tmp_path), tmp_path / "prefix"
    folders = [sources / package for package in PACKAGES]
    run(sys.executable, "-m", "pip", "install", *options, "--prefix", prefix, *folders)
    for package in PACKAGES:
        assert (prefix / "share/ament_index/resource_index/packages" / package).is_file()
        assert (prefix / "share" / package / "package.xml").is_file()
        assert_executables(prefix, package)
    assert_shared_files(prefix)


def test_colcon_builds_links(tmp_path: Path) -> None:
    """Copies, without --symlink-install, are built and looked at by `test_readme.py`."""
    sources, colcon = copy_sources(tmp_path), Path(sys.executable).parent / "colcon"
    build, install = tmp_path / "build", tmp_path / "install"
    places = [f"--build-base={build}", f"--install-base={install}", "--base-paths", sources]
    run(colcon, f"--log-base={tmp_path / 'log'}", "build", "--symlink-install", *places)
    assert_colcon_install(install)

"""Hold the import rules: who may import whom, and where ROS, bags and torch may be imported."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.paths import SRC

FOUNDATION = "pendulum_twin"
PACKAGES = {"pendulum_bridge", "pendulum_rl_env", "pendulum_sysid"}

ROS = {
    "rclpy", "rcl_interfaces", "builtin_interfaces", "rosgraph_msgs", "sensor_msgs", "std_msgs",
    "std_srvs", "diagnostic_msgs", "geometry_msgs",
}  # fmt: skip
LEARNING = {"pendulum_rl_env.learning", "pendulum_rl_env.train", "pendulum_rl_env.studies"}
CONFINED = (  # these packages may be imported in these modules, and nowhere else
    (ROS, {"pendulum_twin.nodes", "pendulum_bridge.nodes", "pendulum_rl_env.nodes"}),
    (
        {"rosbags"},
        {"pendulum_sysid.reading.bag", "pendulum_sysid.reading.ros1", "pendulum_twin.bags.write"},
    ),
    ({"torch"}, LEARNING | {"pendulum_sysid.studies.proof.rival_models.network"}),
    ({"safetensors", "stable_baselines3", "sb3_contrib", "optuna"}, LEARNING),
    ({"mujoco"}, {"pendulum_bridge.emulator"}),
)
# The rooms of pendulum_sysid from the ground up: each imports itself and those before it.
FLOORS = (
    "command_doubt", "records", "verdict", "errors", "decisions", "reading", "cleaning", "fitting",
    "finding", "measuring", "planning", "telling", "plausibility", "prepare", "beside_laws",
    "pipeline", "fleet", "verbs", "studies",
)  # fmt: skip
# The roof: a study may import every package, and only studies import it.
STUDIES = {f"{package}.studies" for package in PACKAGES}
# They open every room and belong to none.
ENTRANCES = {"pendulum_sysid", "pendulum_sysid.api", "pendulum_sysid.cli"}


def is_within(module: str, places: set[str]) -> bool:
    """Tell whether a dotted name is one of the places or lies below one."""
    return any(module == place or module.startswith(place + ".") for place in places)


def name_module(path: Path) -> str:
    """Name a file of src/<package>/<package>/ as Python imports it."""
    parts = path.relative_to(SRC).with_suffix("").parts[1:]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def list_imports(module: str, source: str, is_package: bool = False) -> Iterator[str]:
    """Yield every absolute name that the source may import: `from a import b` gives both."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = [*module.split("."), *([""] if is_package else [])]
            above = parts[: -node.level] if node.level else []
            origin = ".".join(above + ([node.module] if node.module else []))
            yield origin
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def find_floor(module: str) -> int | None:
    """Return the floor of a module of pendulum_sysid; None for the entrances and for others."""
    parts = module.split(".")
    if parts[0] != "pendulum_sysid" or len(parts) < 2 or parts[1] not in FLOORS:
        return None
    return FLOORS.index(parts[1])


def find_offences(module: str, source: str, is_package: bool = False) -> list[str]:
    """List in sentences what a module imports against the rules."""
    offences = []
    package, floor = module.split(".")[0], find_floor(module)
    is_study = is_within(module, STUDIES)
    for name in sorted(set(list_imports(module, source, is_package))):
        if is_within(name, STUDIES) and not is_study and package != "pendulum_sysid":
            offences.append(f"{module} imports {name}: only a study may import a study")
        elif is_within(name, PACKAGES - {package}) and not is_study:
            offences.append(
                f"{module} imports {name}: only {FOUNDATION} may be imported from another package"
            )
        for confined, places in CONFINED:
            if is_within(name, confined) and not is_within(module, places):
                offences.append(f"{module} imports {name}: only {sorted(places)} may")
        above = find_floor(name)
        if module not in ENTRANCES and floor is None and package == "pendulum_sysid":
            offences.append(f"{module} stands on no floor: put it into a room")
        elif floor is not None and above is not None and above > floor:
            offences.append(f"{module} imports {name}: a room imports those before it only")
    return sorted(set(offences))


@pytest.mark.parametrize("path", sorted(SRC.glob("*/pendulum_*/**/*.py")), ids=name_module)
def test_module_keeps_the_import_rules(path: Path) -> None:
    is_package = path.name == "__init__.py"
    assert find_offences(name_module(path), path.read_text(), is_package) == []


def test_every_package_is_looked_at() -> None:
    seen = {name_module(path).split(".")[0] for path in SRC.glob("*/pendulum_*/**/*.py")}
    assert seen == PACKAGES | {FOUNDATION}


@pytest.mark.parametrize(
    ("module", "source", "named"),
    [
        ("pendulum_twin.kernel", "import pendulum_sysid.fitting", "pendulum_sysid.fitting"),
        ("pendulum_sysid.records", "from pendulum_bridge import protocol", "pendulum_bridge"),
        ("pendulum_twin.kernel", "def later():\n    import rclpy.node", "rclpy.node"),
        ("pendulum_sysid.verbs.fit", "from sensor_msgs.msg import JointState", "sensor_msgs.msg"),
        ("pendulum_sysid.records", "from rosbags.highlevel import AnyReader", "rosbags.highlevel"),
        ("pendulum_rl_env.env", "import torch", "torch"),
        ("pendulum_bridge.protocol", "import mujoco", "mujoco"),
        (
            "pendulum_sysid.fitting.fit",
            "from ..finding.judge import lead",
            "pendulum_sysid.finding.judge",
        ),
        (
            "pendulum_sysid.reading.bag",
            "from pendulum_sysid.cleaning import clock",
            "pendulum_sysid.cleaning",
        ),
        ("pendulum_sysid.telling.report", "from .. import pipeline", "pendulum_sysid.pipeline"),
    ],
)
def test_the_checker_finds_an_offence(module: str, source: str, named: str) -> None:
    assert any(f"imports {named}:" in sentence for sentence in find_offences(module, source))


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("pendulum_twin.nodes.twin_node", "import rclpy\nfrom ..stepper import Stepper"),
        ("pendulum_sysid.reading.bag", "import rosbags\nfrom ..records import Split"),
        ("pendulum_sysid.pipeline", "from .finding import search"),
        ("pendulum_sysid.cli", "from pendulum_sysid.studies import proof"),
        ("pendulum_sysid.fitting.fit", "from pendulum_twin import kernel\nfrom .case import Case"),
        ("pendulum_bridge.emulator.rig", "import mujoco"),
        ("pendulum_rl_env.train", "import torch"),
    ],
)
def test_the_checker_lets_good_imports_pass(module: str, source: str) -> None:
    assert find_offences(module, source) == []

"""Hold the import rules: who may import whom, and where ROS, bags, learning and MuJoCo may be touched."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

SRC = Path(__file__).parents[1] / "src"
FOUNDATION = "pendulum_twin"
ROOMS = {"pendulum_bridge", "pendulum_rl_env", "pendulum_sysid"}

ROS = {
    "rclpy", "rcl_interfaces", "builtin_interfaces", "rosgraph_msgs", "sensor_msgs", "std_msgs", "std_srvs",
    "diagnostic_msgs", "geometry_msgs",
}  # fmt: skip
CONFINED = (  # these packages may be imported in these modules, and nowhere else
    (ROS, {"pendulum_twin.nodes", "pendulum_bridge.nodes", "pendulum_rl_env.nodes"}),
    ({"rosbags"}, {"pendulum_sysid.bag", "pendulum_bridge.bag_writer"}),
    (
        {"torch", "stable_baselines3", "sb3_contrib", "optuna"},
        {"pendulum_rl_env.learning", "pendulum_rl_env.train"},
    ),
    ({"mujoco"}, {"pendulum_bridge.emulator"}),
)
STAGES = {
    f"pendulum_sysid.{stage}"
    for stage in (
        "bag", "quality", "split", "compare", "localisation.localise", "propose", "fit", "judge", "identifiability",
        "next_experiment", "report", "thesis_fit",
    )
}  # fmt: skip
MAY_IMPORT_STAGES = {
    "pendulum_sysid.pipeline",
    "pendulum_sysid.search",
    "pendulum_sysid.importing",
    "pendulum_sysid.prove.examine",
    "pendulum_sysid.prove.told",
    "pendulum_sysid.verbs.compare",
    "pendulum_sysid.verbs.diagnose",
    "pendulum_sysid.verbs.fit",
    "pendulum_sysid.verbs.next",
    "pendulum_sysid.verbs.recordings",
    "pendulum_sysid.verbs.replay",
}


def within(module: str, places: set[str]) -> bool:
    """Tell whether a dotted name is one of the places or lies below one."""
    return any(module == place or module.startswith(place + ".") for place in places)


def module_name(path: Path) -> str:
    """Name a file of src/<package>/<package>/ as Python imports it; a package keeps its `__init__`."""
    return ".".join(path.relative_to(SRC).with_suffix("").parts[1:])


def imported(module: str, source: str) -> Iterator[str]:
    """Yield every absolute dotted name that the source may import: `from a import b` gives `a` and `a.b`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = module.split(".")[: -node.level] if node.level else []
            origin = ".".join(above + ([node.module] if node.module else []))
            yield origin
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def offences(module: str, source: str) -> list[str]:
    """List in sentences what a module imports against the rules."""
    found = []
    package = module.split(".")[0]
    for name in sorted(set(imported(module, source))):
        if within(name, ROOMS - {package}):
            found.append(f"{module} imports {name}: only {FOUNDATION} may be imported from another package")
        for confined, places in CONFINED:
            if within(name, confined) and not within(module, places):
                found.append(f"{module} imports {name}: that belongs in {', '.join(sorted(places))}")
        if within(name, STAGES) and package == "pendulum_sysid" and module not in MAY_IMPORT_STAGES:
            found.append(f"{module} imports {name}: only the pipeline and the command line import stages")
    return found


@pytest.mark.parametrize("path", sorted(SRC.glob("*/pendulum_*/**/*.py")), ids=module_name)
def test_module_keeps_the_import_rules(path: Path) -> None:
    assert offences(module_name(path), path.read_text()) == []


def test_every_package_is_looked_at() -> None:
    seen = {module_name(path).split(".")[0] for path in SRC.glob("*/pendulum_*/**/*.py")}
    assert seen == ROOMS | {FOUNDATION}


@pytest.mark.parametrize(
    ("module", "source", "named"),
    [
        ("pendulum_twin.kernel", "import pendulum_sysid.fit", "pendulum_sysid.fit"),
        ("pendulum_sysid.bag", "from pendulum_bridge import protocol", "pendulum_bridge.protocol"),
        ("pendulum_twin.kernel", "def later():\n    import rclpy.node", "rclpy.node"),
        ("pendulum_sysid.nodes.node", "from sensor_msgs.msg import JointState", "sensor_msgs.msg"),
        ("pendulum_sysid.compare", "from rosbags.highlevel import AnyReader", "rosbags.highlevel"),
        ("pendulum_rl_env.env", "import torch", "torch"),
        ("pendulum_bridge.protocol", "import mujoco", "mujoco"),
        ("pendulum_sysid.judge", "from .fit import fit", "pendulum_sysid.fit"),
        ("pendulum_sysid.judge", "from . import fit", "pendulum_sysid.fit"),
        ("pendulum_sysid.windows", "from pendulum_sysid import compare", "pendulum_sysid.compare"),
        ("pendulum_sysid.__init__", "from .bag import read", "pendulum_sysid.bag"),
    ],
)
def test_the_checker_finds_an_offence(module: str, source: str, named: str) -> None:
    assert any(f"imports {named}:" in sentence for sentence in offences(module, source))


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("pendulum_twin.nodes.twin_node", "import rclpy\nfrom ..stepper import Stepper"),
        ("pendulum_sysid.bag", "import rosbags\nfrom .records import Split"),
        ("pendulum_sysid.pipeline", "from . import bag, fit"),
        ("pendulum_sysid.fit", "from pendulum_twin import kernel\nfrom .least_squares import solve"),
        ("pendulum_bridge.emulator.rig", "import mujoco"),
        ("pendulum_rl_env.train", "import torch"),
    ],
)
def test_the_checker_lets_good_imports_pass(module: str, source: str) -> None:
    assert offences(module, source) == []

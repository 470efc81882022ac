"""A law that a rig has shown is a name on the next rig, with another size."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SMALLER = 0.6


def run(*words: object) -> None:
    """Run a program of this Python; a process of its own knows its own effects."""
    subprocess.run([sys.executable, "-m", *map(str, words)], check=True, capture_output=True)


def record_rig(folder: Path, size_factor: float) -> Path:
    """Record a rig with a brake that acts only away from the middle, and return its folder."""
    how = ("--seed", 32211, "--seconds", 40, "--effects", "outward_brake")
    out = ("--out", folder, "--trials", 1, "--size-factor", size_factor)
    run("pendulum_bridge.studies.trials", *out, *how)
    return folder / "trial_0000"


def diagnose(bag: Path, *options: object) -> dict:
    """Return the verdict on a recording of a rig's folder."""
    out = bag.parent / "diagnosis"
    words = ("diagnose", bag, "--twin", bag.parent / "twin.yaml", "--out", out, *options)
    run("pendulum_sysid.cli", *words)
    return json.loads((out / "verdict.json").read_text(encoding="utf-8"))


@pytest.mark.long(seconds=80)
def test_what_is_learned_on_a_rig_is_named_on_another(tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    first, second = record_rig(tmp_path / "1", 1.0), record_rig(tmp_path / "2", SMALLER)
    assert diagnose(first / "bag")["outcome"] == "not_in_catalogue"
    mine = tmp_path / "mine"
    run("pendulum_sysid.cli", "learn", first / "diagnosis", "--name", "brake", "--out", mine)
    named = diagnose(second / "other", "--effects", mine)
    assert named["outcome"] == "named"
    (brake,) = named["missing_physics"]
    drags = [brake["parameters"][name] for name in ("before", "behind")]
    true = json.loads((second / "seal.json").read_text(encoding="utf-8"))["unlisted"]
    size = true["outward_brake"]["parameters"]["n_s_per_m"] / 2
    assert brake["effect"] == "brake"
    assert [drag["value"] for drag in drags] == pytest.approx([size, -size], rel=0.01)

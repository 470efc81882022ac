"""The stages from a concealed rig to a controlled one, each a program of its own room run as a user would run it.

A trial folder (`pendulum_bridge.studies.trials`) holds a rig: bag, seal and nominal twin. What is
concealed is known to the emulator alone; nothing here opens the seal.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.learning.result import SOLVED_MEAN_REWARD
from pendulum_rl_env.process_transport import ProcessTransport
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError

SCRIPTS = Path(sys.executable).parent
LAST_LINES = 3
MOST_TRAININGS, SEED_STEP = 3, 1000  # trainings at most, and from seed to seed


@dataclass(frozen=True)
class ConcealedRig:
    """Hold where a concealed rig's files are: the trial's folder."""

    folder: Path

    @property
    def nominal(self) -> Path:
        """Return the twin file that knows nothing of what is concealed, its constants wrong."""
        return self.folder / "twin.yaml"

    @property
    def recording(self) -> Path:
        """Return a minute of excitation."""
        return self.folder / "bag"

    def env(self, task: Task) -> PendulumEnv:
        """Return the rig as an environment, stepped directly; close it when done."""
        samples = max(1, round(task.step_s * 100))
        command = [
            sys.executable,
            "-m",
            "pendulum_bridge.stepped_rig",
            "--seal",
            str(self.folder / "seal.json"),
        ]
        return PendulumEnv(
            ProcessTransport([*command, "--samples", str(samples)], task.step_s, 60.0), task
        )


@dataclass(frozen=True)
class Diagnosis:
    """Hold where a diagnosis's files are, and its verdict."""

    folder: Path
    verdict: dict[str, Any]

    @property
    def twin(self) -> Path:
        """Return the identified twin's file."""
        return self.folder / "twin.yaml"

    @property
    def names(self) -> list[str]:
        """Return what it calls missing."""
        return [missing["effect"] for missing in self.verdict["missing_physics"]]


def conceal(
    out: Path, number: int, seed: int, kinds: str, nominal: Path, seconds: float = 60.0
) -> ConcealedRig:
    """Draw a rig, play a minute of excitation to it and record it; one that is there already is taken as it is."""
    folder = out / f"trial_{number:04d}"
    if not folder.exists():
        drawn = ["--trials", "1", "--first", str(number), "--seed", str(seed), "--kinds", kinds]
        how = ["--out", str(out), "--twin", str(nominal), "--seconds", str(seconds)]
        run([sys.executable, "-m", "pendulum_bridge.studies.trials", *how, *drawn])
    return ConcealedRig(folder)


def diagnose(rig: ConcealedRig, out: Path) -> Diagnosis:
    """Run `sysid diagnose` on the rig's recording; a verdict that is there already is taken as it is."""
    if not (out / "verdict.json").exists():
        run(
            [
                str(SCRIPTS / "sysid"),
                "diagnose",
                str(rig.recording),
                "--twin",
                str(rig.nominal),
                "--out",
                str(out),
            ]
        )
    return Diagnosis(out, json.loads((out / "verdict.json").read_text(encoding="utf-8")))


def train_policy(twin: Path, out: Path, seed: int, options: Sequence[str] = ()) -> Path:
    """Run `train_policy` and return the policy; one that is there already, whole, is taken as it is."""
    if (
        not (out / "result.json").exists()
        or not json.loads((out / "result.json").read_text())["wall_s"]
    ):
        command = [
            sys.executable,
            "-m",
            "pendulum_rl_env.train",
            "--twin",
            str(twin),
            "--out",
            str(out),
        ]
        resumed = (
            ["--resume"]
            if (out / "result.json").exists() and list(out.glob("checkpoints/*.zip"))
            else []
        )
        run([*command, "--seed", str(seed), *options, *resumed])
    return out / "policy.zip"


def train_until_good(twin: Path, out: Path, seed: int, options: Sequence[str] = ()) -> Path:
    """Train, again with other seeds where a policy is not good in the twin itself, and return the one that is best there.

    Reinforcement learning gets stuck at times. Trying again costs time, and no step on the rig: it
    has no say in the choice.
    """
    tried: dict[Path, float] = {}
    for attempt in range(MOST_TRAININGS):
        folder = out if not attempt else out.with_name(f"{out.name}_again_{attempt}")
        policy = train_policy(twin, folder, seed + SEED_STEP * attempt, options)
        learned = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        tried[policy] = learned["best_mean_reward"] or 0.0
        if tried[policy] >= SOLVED_MEAN_REWARD:
            break
    return max(tried, key=lambda each: tried[each])


def run(command: Sequence[str]) -> None:
    """Run a program; raise BadInputError with its last words when it fails."""
    one_core = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, check=False, capture_output=True, text=True, env={**os.environ, **one_core}
        )
    except OSError as error:
        raise BadInputError(
            f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
        ) from error
    if done.returncode:
        said = " / ".join(done.stderr.strip().splitlines()[-LAST_LINES:])
        raise BadInputError(f"{' '.join(command[:4])} ended with status {done.returncode}: {said}")

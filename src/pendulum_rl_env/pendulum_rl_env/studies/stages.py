"""The stages from a concealed rig to a controlled rig; each runs a command line as a user would.

A trial's folder (`pendulum_bridge.studies.trials`) holds a rig: recording, seal and nominal twin.
Only the emulator knows what is concealed; no stage opens the seal.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pendulum_bridge.studies import trials
from pendulum_rl_env import train
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.kernel_transport import count_samples
from pendulum_rl_env.learning.result import SOLVED_MEAN_REWARD
from pendulum_rl_env.process_transport import ProcessTransport
from pendulum_rl_env.studies.workers import run_program
from pendulum_rl_env.task import Task
from pendulum_sysid import cli

MOST_TRAININGS, SEED_STEP = 3, 1000  # of a twin; from the seed of one training to the next
RIG_DEADLINE_S = 60.0


@dataclass(frozen=True)
class ConcealedRig:
    """Hold where a concealed rig's files are: the trial's folder."""

    folder: Path

    @property
    def nominal(self) -> Path:
        """Return the twin file without the concealed physics, its constants wrong."""
        return self.folder / "twin.yaml"

    @property
    def recording(self) -> Path:
        """Return a minute of excitation."""
        return self.folder / "bag"

    def make_env(self, task: Task) -> PendulumEnv:
        """Return the rig as an environment, stepped directly; close it after use."""
        program = [sys.executable, "-m", "pendulum_bridge.stepped_rig"]
        seal = ["--seal", str(self.folder / "seal.json")]
        samples = ["--samples", str(count_samples(task.step_s))]
        transport = ProcessTransport([*program, *seal, *samples], task.step_s, RIG_DEADLINE_S)
        return PendulumEnv(transport, task)


@dataclass(frozen=True)
class Diagnosis:
    """Hold a diagnosis.

    folder: where its files are.
    verdict: content of verdict.json.
    """

    folder: Path
    verdict: dict[str, Any]

    @property
    def file(self) -> Path:
        """Return the verdict's file."""
        return self.folder / "verdict.json"

    @property
    def twin(self) -> Path:
        """Return the identified twin's file."""
        return self.folder / "twin.yaml"

    @property
    def names(self) -> list[str]:
        """Return the effects that it calls missing."""
        return [missing["effect"] for missing in self.verdict["missing_physics"]]


def conceal(
    out: Path, number: int, seed: int, kinds: str, nominal: Path, seconds: float = 60.0
) -> ConcealedRig:
    """Draw a rig, excite it and record it; a trial that is there already is taken as it is.

    out: folder of the trials.
    number, seed: say which rig.
    kinds: how many effects are concealed, as KIND:SHARE,...
    nominal: twin file of the rig before anything is concealed.
    seconds: s; length of the recording.
    """
    folder = out / f"trial_{number:04d}"
    if not folder.exists():
        which = ["--trials", "1", "--first", str(number), "--seed", str(seed), "--kinds", kinds]
        how = ["--out", str(out), "--twin", str(nominal), "--seconds", str(seconds)]
        run_program("trials", trials.main, [*how, *which])
    return ConcealedRig(folder)


def diagnose(rig: ConcealedRig, out: Path) -> Diagnosis:
    """Diagnose the rig's recording; a verdict that is there already is taken as it is."""
    file = out / "verdict.json"
    if not file.exists():
        bag, twin = str(rig.recording), str(rig.nominal)
        arguments = ["diagnose", bag, "--twin", twin, "--out", str(out)]
        run_program("sysid diagnose", cli.main, arguments)
    return Diagnosis(out, json.loads(file.read_text(encoding="utf-8")))


def refit(rig: ConcealedRig, out: Path) -> Path:
    """Fit the nominal twin's constants to the rig's recording, adding no physics; return a file.

    out: the twin's file; a file that is there already is taken as it is.
    """
    if not out.exists():
        arguments = ["fit", str(rig.recording), "--twin", str(rig.nominal), "--out", str(out)]
        run_program("sysid fit", cli.main, arguments)
    return out


def train_policy(twin: Path, out: Path, seed: int, options: Sequence[str] = ()) -> Path:
    """Train in a twin and return the policy; a finished training is taken as it is.

    twin: file of the twin.
    out: folder of the training; an unfinished training there is resumed.
    seed: of the training.
    options: further arguments of `train`.
    """
    result = out / "result.json"
    if not (result.exists() and json.loads(result.read_text(encoding="utf-8"))["wall_s"]):
        resumable = result.exists() and any(out.glob("checkpoints/*.zip"))
        arguments = ["--twin", str(twin), "--out", str(out), "--seed", str(seed), *options]
        timed = partial(train.main, started_s=time.monotonic())
        run_program("train", timed, [*arguments, *(["--resume"] if resumable else [])])
    return out / "policy.zip"


def train_until_good(
    twin: Path, out: Path, seed: int, options: Sequence[str] = (), most: int | None = None
) -> Path:
    """Train with up to `most` (3) seeds and return the policy that is best in the twin itself.

    Reinforcement learning gets stuck at times. Another training costs time and no step on the rig,
    which has no say in the choice. Arguments: see `train_policy`.
    """
    rewards: dict[Path, float] = {}
    for attempt in range(most or MOST_TRAININGS):
        folder = out if not attempt else out.with_name(f"{out.name}_again_{attempt}")
        policy = train_policy(twin, folder, seed + SEED_STEP * attempt, options)
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        rewards[policy] = result["best_mean_reward"] or 0.0
        if rewards[policy] >= SOLVED_MEAN_REWARD:
            break
    return max(rewards, key=lambda policy: rewards[policy])

"""The controllers of a transfer study: how each is made for a rig, and its rewards there."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

from pendulum_bridge.emulator.seal import open_seal
from pendulum_rl_env.control.classical import make_plant
from pendulum_rl_env.control.design import Controller, design_controller, run_controller
from pendulum_rl_env.control.optimum import find_optimum
from pendulum_rl_env.control.planned import design_planned
from pendulum_rl_env.control.predictive import design_predictive
from pendulum_rl_env.learning.policies import load_controller
from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.changing_rig import open_rig
from pendulum_rl_env.studies.identify_and_control import run_on_rig
from pendulum_rl_env.studies.on_concealed import fine_tune, learn_from_scratch
from pendulum_rl_env.studies.stages import ConcealedRig, Diagnosis
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, save_twin

THESIS_REWARD = 423.0  # of the thesis's policy on its rig, after 130,000 steps there
RESIDUAL = ["--preset", "residual"]

Rewards = Callable[[], list[float]]


class RigControllers:
    """Measure the rewards of controllers on one rig; a training that is there is taken as it is.

    rig: concealed.
    diagnosis: of its recording.
    options: of the study.
    """

    def __init__(
        self, rig: ConcealedRig, diagnosis: Diagnosis, options: argparse.Namespace
    ) -> None:
        self._rig, self._diagnosis, self._options = rig, diagnosis, options
        self._seeds = range(options.train_seed, options.train_seed + options.train_seeds)
        self._verdict = ["--verdict", str(diagnosis.file)]
        self._preset = ["--preset", options.preset]
        if options.timesteps:
            self._preset += ["--timesteps", str(options.timesteps)]

    def list_all(self) -> Mapping[str, Rewards]:
        """Return for each controller, in order, the function that measures its rewards."""
        twin = self._diagnosis.twin
        return {
            "nominal": lambda: self._run(self._train(self._rig.nominal, "nominal", self._preset)),
            "identified": lambda: self._run(self._train_identified()),
            "fine_tuned": self._run_fine_tuned,
            "residual": lambda: self._run(self._train_residual()),
            "refitted": self._run_refitted,
            "real_time": lambda: [self._run_in_real_time(p) for p in self._train_residual()],
            "planned": lambda: [self._run_design(design_planned)],
            "classical": lambda: [self._run_design(design_controller)],
            "predictive": lambda: [self._run_design(design_predictive)],
            "optimum": lambda: [_find_best_reward(twin)],
            "scratch": self._run_scratch,
        }

    def _train(self, twin: Path, name: str, how: list[str]) -> list[Path]:
        """Return the policies of all seeds; each is the best in the twin of some trainings."""
        most, folder = self._options.trainings, self._rig.folder
        return [
            stages.train_until_good(twin, folder / f"{name}_{seed}", seed, how, most)
            for seed in self._seeds
        ]

    def _train_identified(self) -> list[Path]:
        return self._train(self._diagnosis.twin, "identified", [*self._preset, *self._verdict])

    def _train_residual(self) -> list[Path]:
        return self._train(self._diagnosis.twin, "residual", [*RESIDUAL, *self._verdict])

    def _run(self, policies: list[Path]) -> list[float]:
        return [run_on_rig(self._rig, policy).reward for policy in policies]

    def _run_refitted(self) -> list[float]:
        twin = stages.refit(self._rig, self._rig.folder / "refitted.yaml")
        return self._run(self._train(twin, "refitted", RESIDUAL))

    def _run_fine_tuned(self) -> list[float]:
        steps = self._options.fine_steps
        return [self._fine_tune_if_short(policy, steps) for policy in self._train_identified()]

    def _fine_tune_if_short(self, policy: Path, steps: int) -> float:
        """Return the policy's reward on the rig, after fine-tuning there where it falls short."""
        reward = run_on_rig(self._rig, policy).reward
        if reward > THESIS_REWARD:
            return reward
        return fine_tune(policy, self._rig, steps, policy.parent / "fine")

    def _run_scratch(self) -> list[float]:
        steps, folder = self._options.scratch_steps, self._rig.folder
        return [
            learn_from_scratch(self._rig, seed, steps, folder / f"scratch_{seed}")
            for seed in self._seeds
        ]

    def _run_in_real_time(self, policy: Path) -> float:
        """Return the policy's reward in real time, through emulator, driver and topics."""
        sealed = open_seal(self._rig.folder / "seal.json")
        if sealed.unlisted or sealed.rest:
            raise BadInputError(
                f"real_time: expected a rig with effects of the catalogue alone, found "
                f"{', '.join([*sealed.unlisted, *sealed.rest])}: leave out real_time"
            )
        lasting = Twin("sealed", sealed.rig, sealed.effects).drop_recording_effects()
        folder = policy.parent / "real_time"
        folder.mkdir(exist_ok=True)
        save_twin(lasting, folder / "rig.yaml")
        with open_rig(folder, folder / "rig.yaml", None, self._diagnosis.twin) as live:
            return live.play("policy", load_controller(policy, live.task)).reward

    def _run_design(self, design: Callable[[Twin, Task], Controller]) -> float:
        """Return the reward on the rig of a controller that is designed from its twin."""
        task = Task()
        controller = design(load_twin(self._diagnosis.twin), task)
        env = self._rig.make_env(task)
        try:
            return run_controller(env.transport, controller, task)
        finally:
            env.close()


def _find_best_reward(twin: Path) -> float:
    """Return the largest reward that commands earn in a twin itself."""
    return find_optimum(make_plant(load_twin(twin), Task()), starts=2).reward

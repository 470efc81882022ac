"""Presets: how to train, as YAML files keyed by environment id."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from pendulum_rl_env.learning.algorithms import ALGORITHMS, list_settings
from pendulum_rl_env.names import IN_PROCESS, OVER_TOPICS, PRESETS
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import describe_read_error
from pendulum_twin.rig import check_number, describe_unknown_key
from pendulum_twin.strict_yaml import parse_yaml

LARGEST_CORRECTION = 2.0  # of the PWM limit: it turns any command round
LARGEST_LAYER = 10_000  # units; far above what these tasks need
REQUIRED_KEYS = 6  # the first fields of `Preset`, which have no default


@dataclass(frozen=True)
class Preset:
    """Hold how to train on one environment.

    algorithm: a key of `ALGORITHMS`.
    timesteps: how many, where the command line does not say.
    environments: how many side by side, in process.
    layers: hidden layers of policy and value.
    learning_rate: at the start.
    evaluate_every: timesteps from evaluation to evaluation.
    falling: whether the learning rate falls to 0.
    start_spread: share of episodes that begin anywhere, see `Fleet`.
    correction: largest correction of a designed controller's command, a share of the PWM limit,
        see `correction.py`; 0 leaves the whole command to the policy.
    episode_steps: of an episode in training; 0 for the task's own.
    settings: further arguments of the algorithm.

    Raises BadInputError, naming the key, for a value that cannot be.
    """

    algorithm: str
    timesteps: int
    environments: int
    layers: tuple[int, ...]
    learning_rate: float
    evaluate_every: int
    falling: bool = False
    start_spread: float = 0.0
    correction: float = 0.0
    episode_steps: int = 0
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.algorithm not in ALGORITHMS:
            raise BadInputError(
                f"algorithm: expected one of {', '.join(ALGORITHMS)}, found {self.algorithm!r}"
            )
        for name in ("timesteps", "environments", "evaluate_every"):
            _check_whole(name, getattr(self, name), 1, 1e9)
        if not isinstance(self.layers, list | tuple):
            raise BadInputError(f"layers: expected a list of sizes, found {self.layers!r}")
        for size in self.layers:
            _check_whole("layers", size, 1, LARGEST_LAYER)
        check_number("learning_rate", self.learning_rate, 1e-7, 1.0)
        check_number("start_spread", self.start_spread, 0.0, 1.0)
        check_number("correction", self.correction, 0.0, LARGEST_CORRECTION)
        _check_whole("episode_steps", self.episode_steps, 0, 1e6)
        if self.correction and self.algorithm != "ppo":
            raise BadInputError(
                f"correction: expected algorithm ppo, which can begin at 0, found {self.algorithm}"
            )
        object.__setattr__(self, "layers", tuple(self.layers))
        object.__setattr__(self, "settings", dict(self.settings))
        known = list_settings(self.algorithm)
        for key in self.settings:
            if key not in known:
                raise BadInputError(describe_unknown_key("settings", key, tuple(sorted(known))))


def _check_whole(key: str, value: object, low: int, high: float) -> None:
    """Raise BadInputError, naming the key, when value is no whole number in [low, high]."""
    check_number(key, value, low, high)
    if not isinstance(value, int):
        raise BadInputError(f"{key}: expected a whole number, found {value!r}")


def load_preset(name: str, environment: str) -> Preset:
    """Return a preset.

    name: one of `PRESETS`, or the path of a YAML file.
    environment: its id; over topics the settings of the environment in process hold.

    Raises BadInputError when there is no such preset, or it holds something wrong.
    """
    path = files("pendulum_rl_env") / "presets" / f"{name}.yaml" if name in PRESETS else Path(name)
    try:
        mapping = parse_yaml(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, BadInputError) as error:
        known = ", ".join(PRESETS)
        reason = describe_read_error(error)
        raise BadInputError(
            f"--preset: expected {known} or a YAML file, found {name}: {reason}"
        ) from error
    wanted = IN_PROCESS if environment == OVER_TOPICS else environment
    if not isinstance(mapping, Mapping) or not isinstance(mapping.get(wanted), Mapping):
        raise BadInputError(f"{name}: expected settings under the key {wanted}, found none")
    return parse_preset(mapping[wanted], name)


def parse_preset(mapping: Mapping[str, Any], where: str) -> Preset:
    """Return the preset that a mapping holds; raise BadInputError naming the wrong key.

    where: file or name of the preset, for the message.
    """
    known = tuple(field.name for field in fields(Preset))
    for key in mapping:
        if key not in known:
            raise BadInputError(describe_unknown_key(where, str(key), known))
    try:
        return Preset(**mapping)
    except BadInputError as error:
        raise BadInputError(f"{where}: {error}") from error
    except TypeError as error:  # a key is missing, or layers are no list
        required = ", ".join(known[:REQUIRED_KEYS])
        raise BadInputError(f"{where}: expected all of {required}, found {error}") from error

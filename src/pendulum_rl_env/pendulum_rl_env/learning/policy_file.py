"""Read and write `policy.zip`: numbers and names, nothing that runs as code when it is read.

The zip holds `policy.json` (algorithm, layers, spaces, settings, what a player has to know of the
task, what the policy corrects) and `weights.safetensors` (every tensor by its name).
stable-baselines3's own files hold pickles, which run as code; those are read only for a caller who
trusts them, see `policies.py`.
"""

from __future__ import annotations

import io
import json
import lzma
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import torch
from gymnasium import spaces
from safetensors import SafetensorError
from safetensors.torch import load as unpack_tensors
from safetensors.torch import save as pack_tensors
from torch import Tensor

from pendulum_rl_env.control.base import parse_base
from pendulum_rl_env.correction import Correction
from pendulum_rl_env.learning.algorithms import ALGORITHMS
from pendulum_rl_env.learning.preset import LARGEST_CORRECTION
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically
from pendulum_twin.rig import check_number

SCHEMA = "pendulum_policy/1"
FACTS, WEIGHTS = "policy.json", "weights.safetensors"
# Bounds of what is unpacked: a policy of `train` has 10 kB of facts and 0.1 to 10 MB of weights.
MOST_BYTES = {FACTS: 1_000_000, WEIGHTS: 256_000_000}
# What a damaged zip, JSON or safetensors file raises.
UNREADABLE = (
    BadZipFile, SafetensorError, lzma.LZMAError, zlib.error, ValueError, OSError, EOFError,
    KeyError, TypeError, RuntimeError, NotImplementedError, AttributeError, OverflowError,
)  # fmt: skip


@dataclass(frozen=True)
class PolicyFile:
    """Hold what a `policy.zip` says.

    algorithm: a key of `ALGORITHMS`.
    layers: hidden layers of policy and value.
    observation_space, action_space: of the task.
    settings: further arguments of the algorithm: numbers, words and truth values.
    timesteps: of training so far.
    tensors: of networks and optimisers, by name.
    correction: what the policy corrects; None when the command is all its own.
    task: that it was trained for; the file holds the largest command and the sample time, all else
        is the same for every policy. None in a file that does not say, as older files.
    """

    algorithm: str
    layers: tuple[int, ...]
    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any]
    settings: Mapping[str, Any]
    timesteps: int
    tensors: Mapping[str, Tensor]
    correction: Correction | None = None
    task: Task | None = None


def write_policy_file(content: PolicyFile, path: Path) -> None:
    """Write a policy as a whole; raise BadInputError for spaces that the format does not know."""
    facts = {
        "schema": SCHEMA,
        "algorithm": content.algorithm,
        "layers": list(content.layers),
        "observation_space": _describe_space(content.observation_space),
        "action_space": _describe_space(content.action_space),
        "settings": dict(content.settings),
        "timesteps": content.timesteps,
    }
    if content.task is not None:
        facts["task"] = {"pwm_limit": content.task.pwm_limit, "step_s": content.task.step_s}
    if content.correction is not None:
        base, bound = content.correction.base, content.correction.bound
        facts["correction"] = {"bound": bound, "base": base.to_mapping()}
    tensors = {name: t.detach().clone().contiguous() for name, t in content.tensors.items()}
    packed = io.BytesIO()
    with ZipFile(packed, "w") as archive:
        archive.writestr(FACTS, json.dumps(facts, indent=2))
        archive.writestr(WEIGHTS, pack_tensors(tensors))
    write_atomically(path, packed.getvalue())


def read_policy_file(path: Path) -> PolicyFile | None:
    """Return what a policy's file says; None for a zip of stable-baselines3.

    Raises BadInputError when the file is neither.
    """
    try:
        with ZipFile(path) as archive:
            names = archive.namelist()
            if FACTS not in names and "data" in names:
                return None
            facts = json.loads(_unpack(archive, FACTS))
            tensors = unpack_tensors(_unpack(archive, WEIGHTS))
        return _parse_facts(facts, tensors)
    except (BadInputError, *UNREADABLE) as error:
        raise BadInputError(
            f"{path}: expected a policy that `train` has written, found none in it ({error})"
        ) from error


def _unpack(archive: ZipFile, name: str) -> bytes:
    """Return a member of a zip; raise ValueError when it is too large or not there."""
    size = archive.getinfo(name).file_size  # zipfile unpacks no more than this
    if size > MOST_BYTES[name]:
        raise ValueError(f"{name}: expected at most {MOST_BYTES[name]} bytes, found {size}")
    return archive.read(name)


def _parse_facts(facts: dict[str, Any], tensors: dict[str, Tensor]) -> PolicyFile:
    if facts["schema"] != SCHEMA:
        raise ValueError(f"schema: expected {SCHEMA}, found {facts['schema']!r}")
    if facts["algorithm"] not in ALGORITHMS:
        raise ValueError(
            f"algorithm: expected one of {', '.join(ALGORITHMS)}, found {facts['algorithm']!r}"
        )
    for name, tensor in tensors.items():
        if not bool(torch.isfinite(tensor).all()):
            raise ValueError(f"{name}: expected finite weights, found some that are not")
    for name, value in facts["settings"].items():
        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"settings.{name}: expected a number or a word, found {value!r}")
    return PolicyFile(
        facts["algorithm"],
        tuple(int(size) for size in facts["layers"]),
        _parse_space(facts["observation_space"]),
        _parse_space(facts["action_space"]),
        facts["settings"],
        int(facts["timesteps"]),
        tensors,
        _parse_correction(facts["correction"]) if "correction" in facts else None,
        _parse_task(facts["task"]) if "task" in facts else None,
    )


def _parse_task(fact: dict[str, Any]) -> Task:
    return Task.make_for_step(float(fact["step_s"])).take_limit(float(fact["pwm_limit"]))


def _parse_correction(fact: dict[str, Any]) -> Correction:
    bound = float(fact["bound"])
    check_number("bound", bound, 0.0, LARGEST_CORRECTION)
    return Correction(parse_base(fact["base"]), bound)


def _describe_space(space: spaces.Space[Any]) -> dict[str, Any]:
    """Return a space as JSON; raise BadInputError for other kinds than Box and Discrete."""
    if isinstance(space, spaces.Box):
        return {"low": space.low.tolist(), "high": space.high.tolist(), "type": str(space.dtype)}
    if isinstance(space, spaces.Discrete):
        return {"n": int(space.n), "start": int(space.start)}
    raise BadInputError(f"expected an environment with Box or Discrete spaces, found {space}")


def _parse_space(fact: dict[str, Any]) -> spaces.Space[Any]:
    if "n" in fact:
        return spaces.Discrete(int(fact["n"]), start=int(fact["start"]))
    kind = np.dtype(fact["type"])
    return spaces.Box(
        np.array(fact["low"], dtype=kind), np.array(fact["high"], dtype=kind), dtype=kind.type
    )

"""Take all tensors out of a learner by name, and put them into another of the same layers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch import Tensor
from torch.optim import Optimizer

VARIABLES = "variables"  # single tensors of an algorithm, such as SAC's entropy coefficient


def collect_tensors(model: BaseAlgorithm) -> dict[str, Tensor]:
    """Return the tensors of networks and optimisers, and single tensors, by name.

    Names: `<network>/<tensor>`, `<optimiser>/<parameter>/<moment>`, `variables/<name>`.
    """
    parts, variables = model._get_torch_save_params()
    tensors = {f"{VARIABLES}/{name}": _get(model, name).data for name in variables}
    for part in parts:
        owner = _get(model, part)
        if isinstance(owner, Optimizer):
            for index, moments in owner.state_dict()["state"].items():
                for name, value in moments.items():
                    tensors[f"{part}/{index}/{name}"] = torch.as_tensor(value)
        else:
            tensors |= {f"{part}/{name}": t for name, t in owner.state_dict().items()}
    return tensors


def put_tensors(model: BaseAlgorithm, tensors: Mapping[str, Tensor]) -> None:
    """Copy tensors into a learner; raise ValueError when names or shapes are not the learner's.

    Tensors of optimisers may be missing: those optimisers then begin anew.
    """
    parts, variables = model._get_torch_save_params()
    known = {f"{VARIABLES}/{name}": _get(model, name).data for name in variables}
    optimisers: dict[str, Optimizer] = {}
    for part in parts:
        owner = _get(model, part)
        if isinstance(owner, Optimizer):
            optimisers[part] = owner
        else:
            known |= {f"{part}/{name}": t for name, t in owner.state_dict().items()}
    _check_names(known, tensors, set(optimisers))
    moments = {part: _gather_moments(part, o, tensors) for part, o in optimisers.items()}
    with torch.no_grad():
        for name, tensor in known.items():
            tensor.copy_(tensors[name])
    for part, optimiser in optimisers.items():
        optimiser.load_state_dict({**optimiser.state_dict(), "state": moments[part]})


def _check_names(
    known: Mapping[str, Tensor], given: Mapping[str, Tensor], optimisers: set[str]
) -> None:
    names = {name for name in given if name.split("/")[0] not in optimisers}
    if differing := sorted(names ^ set(known)):
        raise ValueError(f"expected the tensors of these layers, found {differing[0]} differing")
    for name, tensor in known.items():
        if given[name].shape != tensor.shape:
            raise ValueError(
                f"{name}: expected shape {tuple(tensor.shape)}, found {tuple(given[name].shape)}"
            )


def _gather_moments(
    part: str, optimiser: Optimizer, tensors: Mapping[str, Tensor]
) -> dict[int, dict[str, Tensor]]:
    """Return an optimiser's moments by parameter; raise ValueError for a shape that cannot be."""
    parameters = [p for group in optimiser.param_groups for p in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for name, tensor in tensors.items():
        if not name.startswith(f"{part}/"):
            continue
        index, moment = name[len(part) + 1 :].split("/")
        if not 0 <= int(index) < len(parameters):
            raise ValueError(f"{name}: expected one of {len(parameters)} parameters")
        if tensor.shape not in (torch.Size([]), parameters[int(index)].shape):
            raise ValueError(f"{name}: expected its parameter's shape, found {tensor.shape}")
        state.setdefault(int(index), {})[moment] = tensor
    return state


def _get(model: BaseAlgorithm, dotted: str) -> Any:
    owner: Any = model
    for name in dotted.split("."):
        owner = getattr(owner, name)
    return owner

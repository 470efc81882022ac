"""Keep the old steps that an off-policy learner replays, as arrays for `--resume`.

The library's own file is a pickle, which runs as code when it is read.
"""

from __future__ import annotations

import io
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically

ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def save_replay(model: OffPolicyAlgorithm, path: Path) -> None:
    """Write the filled part of a learner's buffer, the oldest step first."""
    buffer = _get_buffer(model)
    order = np.arange(buffer.size())
    if buffer.full:
        order = np.roll(order, -buffer.pos)
    content = io.BytesIO()
    np.savez_compressed(content, **{name: getattr(buffer, name)[order] for name in ARRAYS})
    write_atomically(path, content.getvalue())


def load_replay(model: OffPolicyAlgorithm, path: Path) -> None:
    """Fill a learner's buffer with the newest steps of a file; raise BadInputError for others."""
    buffer = _get_buffer(model)
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name][-buffer.buffer_size :] for name in ARRAYS}
        count = len(arrays["rewards"])
        for name, array in arrays.items():
            expected = (count, *getattr(buffer, name).shape[1:])
            if array.shape != expected or not np.isfinite(array).all():
                raise ValueError(f"{name}: expected finite numbers {expected}")
    except (OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile) as error:
        raise BadInputError(
            f"{path}: expected the old steps of this training, found others ({error}): remove "
            "the file to go on without them"
        ) from error
    for name, array in arrays.items():
        getattr(buffer, name)[:count] = array
    buffer.pos, buffer.full = count % buffer.buffer_size, count == buffer.buffer_size


def _get_buffer(model: OffPolicyAlgorithm) -> ReplayBuffer:
    assert isinstance(model.replay_buffer, ReplayBuffer)
    return model.replay_buffer

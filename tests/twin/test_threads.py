"""Lanes shared among threads: every lane once, and the same bits as by one thread."""

import numpy as np
import pytest
from numba.core import config
from support.paths import CONFIG

from pendulum_twin import kernel, threads
from pendulum_twin.mechanics import run_mechanics
from pendulum_twin.model import load_twin
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("lanes", [0, 1, 15, 16, 17, 33, 100])
@pytest.mark.parametrize("cores", [1, 2, 3, 64])
def test_every_lane_is_in_one_part(lanes: int, cores: int, monkeypatch) -> None:
    monkeypatch.setattr(config, "NUMBA_NUM_THREADS", cores)
    parts: list[slice] = []
    threads.share_among_threads(parts.append, lanes, threads.LEAST_STEPS)
    taken = sorted(k for part in parts for k in range(lanes)[part])
    assert taken == list(range(lanes))
    assert len(parts) <= min(cores, threads.MOST_THREADS)
    assert all(part.start % kernel.WIDTH == 0 for part in parts)


def test_little_work_stays_in_the_calling_thread(monkeypatch) -> None:
    monkeypatch.setattr(config, "NUMBA_NUM_THREADS", 8)
    parts: list[slice] = []
    threads.share_among_threads(parts.append, 64, threads.LEAST_STEPS // 64)
    assert parts == [slice(0, 64)]


def test_the_same_bits_whatever_the_number_of_threads(monkeypatch) -> None:
    lanes, samples, sub = 90, 60, 10
    theta = np.repeat(make_theta(load_twin(CONFIG / "inteco.yaml"))[None], lanes, axis=0)
    random = np.random.default_rng(5)
    starts = random.normal(0.0, [0.1, 1.0, 0.2, 2.0], (lanes, 4))
    drives = random.uniform(-0.3, 0.3, (1, samples * sub))
    zeros = np.zeros(lanes, dtype=np.int64)
    runs = []
    for cores in (1, 3):
        monkeypatch.setattr(config, "NUMBA_NUM_THREADS", cores)
        out = np.empty((lanes, samples, 4))
        run_mechanics(drives, zeros, zeros, zeros, starts, theta, 1e-3, sub, out)
        runs.append(out)
    assert lanes * samples * sub >= 2 * threads.LEAST_STEPS
    np.testing.assert_array_equal(*runs)

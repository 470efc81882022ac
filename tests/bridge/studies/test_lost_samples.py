"""A recording with gaps that a busy computer left is told from a whole recording."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pendulum_bridge.studies import lost_samples
from pendulum_bridge.studies.lost_samples import SamplesLostError, check_samples

STAMPS_S = 5.0 + 0.01 * np.arange(1000) + 1e-4 * np.random.default_rng(1).normal(size=1000)


def keep(lost: slice) -> np.ndarray:
    return np.delete(STAMPS_S, lost)


@pytest.mark.parametrize(
    ("stamps_s", "share"),
    [
        (STAMPS_S, 0.0),
        (keep(slice(100, 130)), 0.03),
        (keep(slice(1, 400, 4)), 0.1),
        (STAMPS_S[:1], 0.0),
    ],
    ids=["whole", "a standstill", "every fourth", "a sample"],
)
def test_lost_samples_are_counted(stamps_s: np.ndarray, share: float) -> None:
    assert lost_samples.compute_lost_share(stamps_s) == pytest.approx(share)


def test_a_busy_computer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def read(lost: slice):
        return lambda path: SimpleNamespace(state_stamp_s=keep(lost))

    monkeypatch.setattr(lost_samples, "read_bag", read(slice(100, 130)))
    check_samples(Path("recording"))
    monkeypatch.setattr(lost_samples, "read_bag", read(slice(100, 210)))
    with pytest.raises(SamplesLostError) as caught:
        check_samples(Path("recording"))
    assert str(caught.value) == (
        "11 % of the emulated rig's samples were lost, for this computer stood still for 1110 ms "
        "and is busy"
    )

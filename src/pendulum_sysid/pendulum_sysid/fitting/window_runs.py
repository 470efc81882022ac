"""Free runs of a twin on windows of a recording, beside what was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.windows import gather, list_channels
from pendulum_sysid.records import Split, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta

JOINTS, UNITS = ("cart", "pole"), ("m", "rad")


@dataclass(frozen=True)
class WindowRuns:
    """Hold free runs of a twin, driven by the recorded command from each window's smoothed start.

    channels: 0 for the cart, 1 for the pole: those that the recording holds, in the order of the
        last axes below.
    begin_s: (windows,) s from the recording's start to the window's first sample.
    period_s: s between two samples.
    measured, runs: (windows, samples, channels), m for the cart, rad for the pole.
    counts: (windows, samples, channels), 1 where a measured sample is valid, else 0.
    noise: (channels,) standard deviation of each sensor's noise, m or rad.

    Errors of a run that diverged are infinite.
    """

    channels: tuple[int, ...]
    begin_s: Floats
    period_s: float
    measured: Floats
    runs: Floats
    counts: Floats
    noise: Floats

    def __len__(self) -> int:
        return len(self.begin_s)

    @property
    def seconds(self) -> float:
        """Return how long each window is, s."""
        return (self.measured.shape[1] - 1) * self.period_s

    @property
    def squares(self) -> Floats:
        """Return the sum of squared errors of each window, (windows, channels), m^2 and rad^2."""
        with np.errstate(all="ignore"):
            errors = np.where(self.counts > 0.0, self.measured - self.runs, 0.0)
            return np.nan_to_num(np.sum(errors**2, axis=1), nan=np.inf, posinf=np.inf)

    @property
    def rmse(self) -> Floats:
        """Return the root mean square error over all valid samples, (channels,), m and rad."""
        return np.sqrt(self.squares.sum(axis=0) / np.maximum(self.counts.sum(axis=(0, 1)), 1.0))

    @property
    def window_rmse(self) -> Floats:
        """Return the root mean square error of each window, (windows, channels), m and rad."""
        return np.sqrt(self.squares / np.maximum(self.counts.sum(axis=1), 1.0))

    @property
    def score(self) -> float:
        """Return the root mean square of all errors, each in units of its sensor's noise."""
        return float(np.sqrt(np.sum(self.squares / self.noise**2) / np.sum(self.counts)))

    @property
    def typical(self) -> float:
        """Return the error of the median window, in units of the sensors' noise."""
        return float(np.median(np.sqrt(np.mean((self.window_rmse / self.noise) ** 2, axis=1))))

    def of_joint(self, joint: int, values: Floats) -> float | None:
        """Return a joint's entry of values (channels,); None when it is not recorded.

        joint: 0 for the cart, 1 for the pole.
        """
        return float(values[self.channels.index(joint)]) if joint in self.channels else None


def run_windows(case: Case, windows: Windows) -> WindowRuns:
    """Return the free runs of the case's twin on windows of its recording."""
    signals = case.signals
    present = list_channels(signals)
    set_of = np.zeros(len(windows), dtype=np.int64)
    with np.errstate(all="ignore"):
        states = run_freely(
            signals,
            make_theta(case.twin)[None],
            set_of,
            windows.begin,
            windows.start_states,
            windows.samples,
        )
    measured, counts = gather(signals, windows.begin, windows.samples)
    return WindowRuns(
        channels=present,
        begin_s=signals.times_s[windows.begin],
        period_s=signals.period_s,
        measured=measured,
        runs=states[..., list(present)],
        counts=counts,
        noise=case.noise,
    )


def run_parts(case: Case, split: Split) -> dict[str, WindowRuns]:
    """Return the free runs of the case's twin, keyed as the windows of the split."""
    parts = {"train": split.train, "learn": split.learn, "held_out": split.held_out}
    return {name: run_windows(case, windows) for name, windows in parts.items()}

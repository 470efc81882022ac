"""What a rival's model is: it runs windows of a recording freely, as a twin does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.fitting.windows import gather, list_channels
from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

MOST_SCORE = 1e9  # of runs that diverge: so large that it says so, and still a number


class Model(Protocol):
    """Predict what the sensors show, from a start state and the command that follows."""

    def run(self, signals: Signals, windows: Windows) -> Floats:
        """Return free runs on windows of a recording, (windows, samples, 4).

        signals: the recording, of which the command alone may be used.
        windows: where the runs begin, and their measured start states x (m), th (rad), v (m/s),
            w (rad/s), which are the first samples of the runs.

        A run that diverges may hold infinities and NaN.
        """
        ...


@dataclass(frozen=True)
class TwinModel:
    """A twin as a model."""

    twin: Twin

    def run(self, signals: Signals, windows: Windows) -> Floats:
        """Return the twin's free runs; see `Model`."""
        set_of = np.zeros(len(windows), dtype=np.int64)
        theta = make_theta(self.twin)[None]
        return run_freely(
            signals, theta, set_of, windows.begin, windows.start_states, windows.samples
        )


def measure_score(model: Model, case: Case, windows: Windows) -> float:
    """Return a model's score on windows of a recording, as `compare` computes a twin's.

    It is the root mean square error in units of the sensors' noise, at most MOST_SCORE.
    """
    signals = case.signals
    with np.errstate(all="ignore"):
        states = model.run(signals, windows)
        measured, counts = gather(signals, windows.begin, windows.samples)
        channels = list_channels(signals)
        score = WindowRuns(
            channels=channels,
            begin_s=signals.times_s[windows.begin],
            period_s=signals.period_s,
            measured=measured,
            runs=states[..., list(channels)],
            counts=counts,
            noise=case.noise,
        ).score
    return min(score, MOST_SCORE) if np.isfinite(score) else MOST_SCORE


def check_both_joints(ground: Ground) -> None:
    """Raise BadInputError for a recording without a cart or without a pole."""
    if ground.case.signals.cart is None or ground.case.signals.pole is None:
        raise BadInputError(
            "expected a recording of cart and pole, for the model predicts both, "
            "found a single joint: leave out --rivals"
        )

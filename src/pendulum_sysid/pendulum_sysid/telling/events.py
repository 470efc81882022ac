"""Whether what is missing stands in a few short stretches: a touch, a stop, a spot of the rail.

A law of physics acts whenever its variables are there again. Where the twin runs at its noise
floor but for a few stretches, no place in the chain is at fault.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.noise_floor import NoiseFloor
from pendulum_sysid.fitting.stretches import join_stretches
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.telling.outcome import Findings, runs_at_noise
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class Events:
    """Hold the few stretches in which all that is unexplained stands.

    intervals_s: (begin, end) of each, s.
    rest: error of the median window, over that of a perfect model.
    """

    intervals_s: tuple[tuple[float, float], ...]
    rest: float

    @property
    def sentence(self) -> str:
        """Return a clause for a person."""
        spans = [f"{_format(begin)} to {_format(end)} s" for begin, end in self.intervals_s]
        where = spans[0] if len(spans) == 1 else f"{', '.join(spans[:-1])} and {spans[-1]}"
        return (
            f"Something that no effect of the catalogue explains acts on the rig at {where}: a "
            "touch, a stop, a cable or a spot of the rail; elsewhere the improved twin's error "
            f"is {max(self.rest, 1.0):.2g} times its noise floor"
        )


def _format(time_s: float) -> str:
    """Return a time with tenths of a second, where it has them."""
    return f"{time_s:.1f}".removesuffix(".0")


def list_events(findings: Findings) -> Events | None:
    """Return the stretches in which all that is unexplained stands; None for other errors.

    Where effects or laws explain a part, the rest is told as what remains. Effects that are no
    names may explain a part as well: the constants alone have to leave few stretches, too.
    """
    if findings.floor is None or findings.named or findings.laws or runs_at_noise(findings):
        return None
    signals = findings.case.signals
    begins_s = signals.times_s[list(signals.stretch_begins)]
    parts = findings.after["learn"], findings.after["held_out"]
    alone = None if findings.best.effects == findings.base.effects else findings.base_runs
    if alone is not None and find_events((alone,), findings.floor, begins_s) is None:
        return None
    return find_events(parts, findings.floor, begins_s)


def find_events(
    parts: tuple[WindowRuns, ...], floor: NoiseFloor, begins_s: Floats
) -> Events | None:
    """Return the few stretches in which runs are far off; None where most runs are off.

    parts: runs of the improved twin; the median window of each has to be near the floor.
    begins_s: (stretches,) of the recording's stretches, s. A run that begins there starts from a
        state that is smoothed from one side only, and is not asked.
    """
    windows = [ask_windows(runs, begins_s) for runs in parts]
    if not all(len(errors) for errors, _ in windows):
        return None
    # of each part: held-out runs that are all far off are no event
    rest = max(float(np.median(errors)) for errors, _ in windows) / floor.typical
    errors, windows_s = (np.concatenate(column) for column in zip(*windows, strict=True))
    far = errors > decisions.EVENT_FLOORS * max(rest, 1.0) * floor.typical
    if rest > decisions.EVENT_REST_FLOORS or np.mean(far) > decisions.EVENT_MOST_SHARE:
        return None
    intervals = join_stretches(windows_s[far], parts[0].seconds)
    few = 0 < len(intervals) <= decisions.MOST_EVENTS
    return Events(intervals, rest) if few else None


def ask_windows(runs: WindowRuns, begins_s: Floats) -> tuple[Floats, Floats]:
    """Return the errors of windows, in units of the sensors' noise, and their begins, s.

    Windows at the begin of a stretch are left out.
    """
    stretch = np.searchsorted(begins_s, runs.begin_s, "right") - 1
    inside = runs.begin_s - begins_s[stretch] >= decisions.FLOOR_LEAD_S
    errors = np.sqrt(np.mean((runs.window_rmse / runs.noise) ** 2, axis=1))
    return errors[inside], runs.begin_s[inside]

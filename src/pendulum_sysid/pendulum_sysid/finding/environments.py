"""Ask the size of an effect again in environments, in which the rig moves otherwise.

A cause has the same size wherever the rig is and however it moves. What only stands in the place
of a cause changes its size with the motion (invariant prediction: Peters, Buhlmann and
Meinshausen, J. R. Stat. Soc. B 78 (2016) 947). Environments are thirds of the windows by time, by
place, and by how the rig moves in them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.replication import estimate_part
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import BY_NAME


@dataclass(frozen=True)
class Steadiness:
    """Hold an effect's size in each environment.

    shares: (environments,) size there over the size in all windows.
    deviations: (environments,) their standard deviations; infinite where nothing fixes the size.
    """

    shares: Floats
    deviations: Floats

    @property
    def _reach(self) -> Floats:
        return decisions.INTERVAL_DEVIATIONS * self.deviations

    @property
    def is_steady(self) -> bool:
        """Return whether every environment that could show the effect shows its size.

        An environment could show the effect if it would surely (97.5 %) show the size that all
        windows have: its own interval is narrower than the size.
        """
        could = 2.0 * self._reach < 1.0
        shown = (self.shares > self._reach) & (
            abs(self.shares - 1.0) <= 1.0 - decisions.STEADY_SHARE
        )
        enough = np.mean(could) > decisions.REPLICATED_SHARE
        return bool(enough and np.all(shown[could])) and not self.is_contradicted

    @property
    def is_contradicted(self) -> bool:
        """Return whether the size is surely another in an environment that could show it."""
        off = abs(self.shares - 1.0) - self._reach > 1.0 - decisions.STEADY_SHARE
        return bool(np.any(off & (self._reach < 1.0)))


def measure_steadiness(case: Case, split: Split, fit: Fit) -> dict[str, Steadiness]:
    """Return the steadiness of each effect of a fit that has a finite size.

    The shapes of laws stay as all windows have them: an environment is asked for sizes alone.
    """
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    system = linearise(problem, fit.theta, fit.start_states, free, fit.power)
    environments = list_environments(case, split)
    steadiness = {}
    for name in [e for e in fit.effects if not BY_NAME[e].of_recording]:
        sizes = [p for p in BY_NAME[name].sizes if np.isfinite(p.neutral)]
        if sizes and f"{name}.{sizes[0].name}" in {p.name for p in free}:
            steadiness[name] = _ask(system, environments, fit, free, name)
    return steadiness


def list_environments(case: Case, split: Split) -> list[Ints]:
    """Return the windows of each environment, as indices into the windows that are fitted."""
    windows, states = split.learn, case.state.states
    at = np.asarray(windows.begin)[:, None] + np.arange(windows.samples)
    x, th, v, w = np.moveaxis(states[at], -1, 0)
    means = [
        at[:, 0].astype(float),
        x.mean(axis=1),
        abs(v).mean(axis=1),
        np.cos(th).mean(axis=1),
        np.sin(th).mean(axis=1),
        abs(w).mean(axis=1),
        abs(case.signals.command[at]).mean(axis=1),
    ]
    return [
        part
        for mean in means
        if np.ptp(mean) > 0.0
        for part in np.array_split(np.argsort(mean, kind="stable"), decisions.REPLICATION_PARTS)
    ]


def _ask(
    system: System, environments: list[Ints], fit: Fit, free: tuple[Free, ...], name: str
) -> Steadiness:
    """Return the steadiness of one effect, beside all other parameters but its own shape."""
    effect = BY_NAME[name]
    shapes = {f"{name}.{p.name}" for p in effect.parameters if p.shape}
    neutral = {f"{name}.{p.name}": p.neutral for p in effect.sizes}
    kept = [k for k, parameter in enumerate(free) if parameter.name not in shapes]
    kept_free = tuple(free[k] for k in kept)
    own = system.pick(kept)
    at = [k for k, parameter in enumerate(kept_free) if parameter.name in neutral]
    sizes = np.array([kept_free[k].size for k in at])
    whole = (
        np.array([kept_free[k].get(fit.theta) - neutral[kept_free[k].name] for k in at]) / sizes
    )
    squared = max(float(whole @ whole), 1e-300)
    shares, deviations = np.empty(len(environments)), np.empty(len(environments))
    for k, windows in enumerate(environments):
        part = (windows[:, None] * fit.pieces + np.arange(fit.pieces)).reshape(-1)
        step, spread = estimate_part(own, part, fit, kept_free)
        shares[k] = whole @ (whole + step[at]) / squared
        with np.errstate(invalid="ignore"):  # a size of 0 that nothing fixes
            deviations[k] = np.linalg.norm(whole * spread[at] / sizes) / squared
    return Steadiness(shares, deviations)

"""The pole by itself: its axis moves as the cart was recorded, and the cart has no model.

What the cart's model lacks does not reach the pole then, so that effects of the pole show without
it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.finding.environments import measure_steadiness
from pendulum_sysid.finding.growth import grow_set
from pendulum_sysid.finding.journal import Journal, Search
from pendulum_sysid.finding.pruning import prune_set
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.sensors import undo_sensors


@dataclass(frozen=True)
class PoleAnswer:
    """Hold what the pole shows by itself.

    search: on the pole's own case.
    base: its fit of constants alone.
    best: its fit with the effects that it needs.
    steady: of these effects those of the same size wherever the pole is and however it moves.
    """

    search: Search
    base: Fit
    best: Fit
    steady: tuple[str, ...]

    @property
    def effects(self) -> tuple[str, ...]:
        """Return the effects that the pole needs; on the whole rig they are expected."""
        return tuple(name for name in self.best.effects if name not in self.base.effects)


def search_pole_alone(search: Search, base: Fit) -> PoleAnswer | None:
    """Return what the pole shows by itself; None unless the recording holds cart and pole.

    None, too, where both joints together are valid in too few windows.

    base: the rig's constants alone, its signs right.
    """
    case = put_pole_on_moving_axis(search.case, base.theta)
    if case is None or not decisions.ASK_POLE_ALONE:
        return None
    try:
        split = split_windows(case.signals, case.state)
    except UnusableRecording:
        return None
    given = tuple(
        name
        for name in base.effects
        if name in case.twin.effects or BY_NAME[name].place is Place.SENSOR
    )
    report = search.journal.report
    report(Stage.POLE)
    journal = Journal(lambda line: report(f"the pole by itself: {line}"))
    alone = Search(case, split, journal, is_pole_alone=True)
    values = {e: case.twin.effects[e] if BY_NAME[e].parameters else {} for e in given}
    theta = make_theta(replace(case.twin, effects=values))
    first = fit(case, alone.split, given, theta, base.pieces)
    best = prune_set(alone, first.effects, grow_set(alone, first))
    added = [name for name in best.effects if name not in first.effects]
    steadiness = measure_steadiness(case, alone.split, best) if added else {}
    steady = tuple(name for name in added if name in steadiness and steadiness[name].is_steady)
    return PoleAnswer(alone, first, best, steady)


def add_pole_effects(search: Search, base: Fit, pole: Fit, names: Collection[str]) -> Fit:
    """Return the base with some effects of the pole's fit, fitted on the whole rig."""
    if not names:
        return base
    theta = base.theta.copy()
    for name in names:
        theta[SLOTS[name]] = pole.theta[SLOTS[name]]
    return search.fit_effects((*base.effects, *names), base, theta)


def put_pole_on_moving_axis(case: Case, theta: Floats) -> Case | None:
    """Make the case of the pole alone; None unless the recording holds cart and pole.

    theta: (SIZE,) parameter vector, for the sign of the cart's sensor.

    The command of the new case is the mean acceleration of the pole's axis over each period,
    m/s^2, from the smoothed velocities.
    """
    signals = case.signals
    if signals.cart is None or signals.pole is None:
        return None
    v = undo_sensors(case.state.states[None], theta[None], signals.clock_s)[0][:, 2]
    acceleration = np.zeros(len(signals))
    for stretch in signals.stretches:
        acceleration[stretch] = np.append(np.diff(v[stretch]), 0.0) / signals.period_s
    alone = replace(
        signals,
        command=acceleration,
        parts=None,
        cart=None,
        pole_valid=signals.pole_valid & signals.cart_valid,
    )
    recording = replace(case.recording, signals=alone, doubt=None, at_once=None)
    return replace(make_case(recording, smooth_state(alone), case.twin), step_s=case.step_s)

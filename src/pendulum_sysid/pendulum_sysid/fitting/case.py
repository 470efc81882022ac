"""One case to be diagnosed: a recording, the twin to start from, and what both fix about sizes and noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pendulum_sysid.finding.angle_steps import AngleStep, angle_steps
from pendulum_sysid.fitting.linearised import Problem
from pendulum_sysid.fitting.parameters import Scales, scales_of
from pendulum_sysid.fitting.windows import SmoothState, noise_of, smooth_state
from pendulum_sysid.records import Recording, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.errors import BadInputError
from pendulum_twin.free_runs import undo_sensors
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import CART_KEYS, POLE_KEYS, Rig
from pendulum_twin.signals import Signals

START_DOUBT = 1.0  # times the deviation that noise leaves in a smoothed start


@dataclass(frozen=True)
class Case:
    """Hold a recording with its smoothed states, the twin to start from, and typical sizes for the fit's steps.

    angle_steps: where an encoder may have slipped.
    """

    recording: Recording
    state: SmoothState
    twin: Twin
    scales: Scales
    angle_steps: tuple[AngleStep, ...] = ()

    @property
    def signals(self) -> Signals:
        """Return the recording's signals."""
        return self.recording.signals

    @property
    def noise(self) -> Floats:
        """Return the sensors' noise in channel order (m, rad)."""
        return noise_of(self.state.noise)

    def problem(self, windows: Windows) -> Problem:
        """Return these windows as data of a fit."""
        return Problem(self.signals, windows, START_DOUBT * self.state.deviations)


def case_of(recording: Recording, twin: Twin) -> Case:
    """Return a recording with a twin cut down to the joints that it holds.

    Raises BadInputError when the recording has a joint that the twin lacks.
    """
    signals = recording.signals
    twin = _cut_to(twin, signals)
    state = smooth_state(signals)
    steps = angle_steps(signals, state.noise.pole_rad)
    return Case(recording, state, twin, scales_of(signals, state, make_theta(twin)), steps)


def pole_on_its_moving_axis(case: Case, theta: Floats) -> Case | None:
    """Return the case of the pole alone, its axis moved as the cart was recorded; None when the rig has not both.

    What the cart's model lacks does not reach the pole then. theta: (SIZE,), for the cart's sign.
    The command is the axis's mean acceleration over each period, from the smoothed velocities,
    m/s^2.
    """
    signals, state = case.signals, case.state
    if signals.cart is None or signals.pole is None:
        return None
    v = undo_sensors(state.states[None], theta[None], signals.clock_s)[0][:, 2]
    acceleration = np.zeros(len(signals))
    for stretch in signals.stretches:
        acceleration[stretch] = np.append(np.diff(v[stretch]), 0.0) / signals.period_s
    alone = replace(
        signals,
        command=acceleration,
        cart=None,
        pole_valid=signals.pole_valid & signals.cart_valid,
    )
    return case_of(replace(case.recording, signals=alone), case.twin)


def _cut_to(twin: Twin, signals: Signals) -> Twin:
    """Return the twin without the joint that the recording lacks; mass and first moment of the rest stay what they were."""
    rig = twin.rig
    for joint, there, has in (
        ("cart", signals.cart, rig.has_cart),
        ("pole", signals.pole, rig.has_pole),
    ):
        if there is not None and not has:
            raise BadInputError(
                f"expected a twin with a {joint}, for the recording holds one, found none: give the twin file's keys of it"
            )
    if signals.cart is None and rig.has_cart:
        moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
        gone: dict[str, Any] = dict.fromkeys((*CART_KEYS, "rail_half_length_m", "pwm_limit"))
        alone = replace(rig, **{**gone, "com_distance_m": moment / (rig.pole_mass_kg or 1.0)})
        return _without(twin, alone, (Place.COMMAND, Place.DRIVE, Place.CART))
    if signals.pole is None and rig.has_pole:
        gone = dict.fromkeys(POLE_KEYS)
        alone = replace(rig, **{**gone, "cart_mass_kg": rig.total_mass_kg})
        return _without(twin, alone, (Place.POLE,))
    return twin


def _without(twin: Twin, rig: Rig, places: tuple[Place, ...]) -> Twin:
    return replace(
        twin,
        rig=rig,
        effects={n: v for n, v in twin.effects.items() if BY_NAME[n].place not in places},
    )

"""A case to be diagnosed: a recording, the twin to start from, and the sizes that both fix."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fitting.parameters import Scales, compute_scales
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.windows import list_noise
from pendulum_sysid.records import Recording, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.laws import BY_NAME as KINDS_BY_NAME
from pendulum_twin.laws.kind import Variable
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import CART_KEYS, POLE_KEYS, Rig
from pendulum_twin.signals import Signals

OF_CART = (Variable.COMMAND, Variable.POSITION, Variable.VELOCITY, Variable.WAY, Variable.SHAFT)
OF_POLE = (Variable.ANGLE, Variable.RATE, Variable.TURN)


@dataclass(frozen=True)
class Case:
    """Hold a recording, the twin to start from, and what both fix for a fit.

    state: the recording's smoothed motion.
    scales: typical sizes of this rig's motion, which set the steps of a fit.
    step_s: s, the longest step of runs in a fit; None for the twin's own.
    """

    recording: Recording
    state: SmoothState
    twin: Twin
    scales: Scales
    step_s: float | None = None

    @property
    def signals(self) -> Signals:
        """Return the recording's signals."""
        return self.recording.signals

    @property
    def noise(self) -> Floats:
        """Return the sensors' noise in channel order (m, rad)."""
        return list_noise(self.state.noise)

    def problem(self, windows: Windows) -> Problem:
        """Return these windows as data of a fit."""
        deviations = decisions.START_DOUBT * self.state.deviations
        return Problem(self.signals, windows, deviations, self.step_s)


def make_case(recording: Recording, state: SmoothState, twin: Twin) -> Case:
    """Make a case of a recording and a twin, which loses the joints that the recording lacks.

    Raises WrongUse when the recording holds a joint that the twin lacks.
    """
    twin = cut_to_joints(twin, recording.signals)
    scales = compute_scales(recording.signals, state, make_theta(twin))
    return Case(recording, state, twin, scales)


def change_twin(case: Case, twin: Twin) -> Case:
    """Make a case of the same recording for another twin; raises what `make_case` raises."""
    return make_case(case.recording, case.state, twin)


def cut_to_joints(twin: Twin, signals: Signals) -> Twin:
    """Take the joint that the recording lacks out of the twin; its mass and moment stay.

    Raises WrongUse when the recording holds a joint that the twin lacks.
    """
    rig = twin.rig
    for joint, there, has in (
        ("cart", signals.cart, rig.has_cart),
        ("pole", signals.pole, rig.has_pole),
    ):
        if there is not None and not has:
            raise WrongUse(
                f"expected a twin with a {joint}, for the recording holds one, found none: "
                "give the twin file's keys of it"
            )
    if signals.cart is None and rig.has_cart:
        moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
        gone: dict[str, Any] = dict.fromkeys((*CART_KEYS, "rail_half_length_m", "pwm_limit"))
        alone = replace(rig, **{**gone, "com_distance_m": moment / (rig.pole_mass_kg or 1.0)})
        return _leave_out(twin, alone, (Place.COMMAND, Place.DRIVE, Place.CART), OF_CART)
    if signals.pole is None and rig.has_pole:
        gone = dict.fromkeys(POLE_KEYS)
        alone = replace(rig, **{**gone, "cart_mass_kg": rig.total_mass_kg})
        return _leave_out(twin, alone, (Place.POLE,), OF_POLE)
    return twin


def _leave_out(
    twin: Twin, rig: Rig, places: tuple[Place, ...], variables: tuple[Variable, ...]
) -> Twin:
    """Return the twin of a rig that lacks a joint: what is at places, or over variables, goes."""
    return replace(
        twin,
        rig=rig,
        effects={n: v for n, v in twin.effects.items() if BY_NAME[n].place not in places},
        measured_laws={
            name: law
            for name, law in twin.measured_laws.items()
            if KINDS_BY_NAME[name].place not in places
            and KINDS_BY_NAME[name].variable not in variables
        },
        spreads={k: sd for k, sd in twin.spreads.items() if k in rig.to_mapping()},
    )

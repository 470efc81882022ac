"""The ground of every rival: windows as the diagnosis cuts them, signs and constants fitted."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.separation import find_stand_in
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


@dataclass(frozen=True)
class Ground:
    """Hold what a rival works on.

    case: the recording and the nominal twin.
    split: the diagnosis's windows.
    base: the fit of the rig's constants with the right signs.
    """

    case: Case
    split: Split
    base: Fit

    @property
    def signs(self) -> tuple[str, ...]:
        """The wrong signs that the base holds; every rival's answer begins with them."""
        return tuple(name for name in self.base.effects if name not in self.case.twin.effects)


def make_ground(case: Case, split: Split) -> Ground:
    """Return what the diagnosis itself begins with, so that no rival fails for a wrong sign."""
    return Ground(case, split, fit_parameters_alone(Search(case, split)))


def list_terms(ground: Ground) -> tuple[Effect, ...]:
    """Return the effects that a fit of this rig's positions can hold beside the base.

    Left out are effects for which another effect stands, and effects with a parameter that no fit
    moves: a time that is read off the recording, a step whose change makes the runs jump.
    """
    rig, constants = ground.case.twin.rig, list_rig_parameters(ground.case.twin)
    places = {Place.CLOCK} | ({Place.COMMAND, Place.DRIVE, Place.CART} if rig.has_cart else set())
    if rig.has_pole:
        places |= {Place.POLE, Place.SENSOR}
    return tuple(
        effect
        for effect in CATALOGUE
        if effect.searched
        and effect.parameters
        and effect.place in places
        and effect.form is not Form.REPORT
        and find_stand_in(effect, constants) is None
        and effect.name not in ground.base.effects
        and not any(p.located or p.jumps for p in effect.parameters)
    )


def set_effect(theta: Floats, effect: Effect, values: tuple[float, ...] | None = None) -> None:
    """Set an effect's parameters in theta (SIZE,); None takes the effect out."""
    theta[SLOTS[effect.name]] = get_neutral_values(effect) if values is None else values

"""Play a plan twice in one recording, so that it shows how much of an error comes again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.errors import WrongUse
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Rest
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.rig import Rig

QUIET = 0.02  # of a swing, that is left of it after the rest
LONGEST_REST_S = 120.0


def repeat_plan(plan: Plan, rig: Rig) -> Plan:
    """Return a plan that is played, rests until the pole hardly swings, and is played again.

    rig: whose pole swings out; its amplitude falls as exp(-b t / 2J) (viscous friction b, inertia
        J; dry friction makes it fall faster).

    Raises WrongUse where the whole is longer than a plan may be.
    """
    viscous, inertia = rig.pole_viscous_n_m_s, rig.pole_inertia_kg_m2
    rest_s = LONGEST_REST_S
    if viscous and inertia:
        rest_s = min(2.0 * inertia / viscous * float(np.log(1.0 / QUIET)), LONGEST_REST_S)
    rest = Rest(seconds=round(max(rest_s, 1.0), 1), centred=True)
    twice = replace(plan, phases=(*plan.phases, rest, *plan.phases))
    try:
        make_excitation(twice, make_envelope(rig))
    except BadInputError as error:
        raise WrongUse(
            f"expected a plan that may be played twice, found {error}: ask for fewer --seconds"
        ) from error
    return twice

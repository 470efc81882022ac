"""Everything that is asked of a recording about a twin, and what explains the force and torque that the twin lacks."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid.finding.localisation.balance import Along, Balance, along, balances
from pendulum_sysid.finding.localisation.explain import explanation, gains, missing_power
from pendulum_sysid.finding.localisation.measured_curves import Curve, curves
from pendulum_sysid.finding.localisation.past_questions import past_questions
from pendulum_sysid.finding.localisation.questions import Question, questions
from pendulum_sysid.finding.localisation.sensor_questions import sensor_questions
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.thinning import thinned
from pendulum_sysid.finding.localisation.waves import waves
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    FORCE_PER_PWM,
    MOMENT,
    POLE_VISCOUS,
)


@dataclass(frozen=True)
class Inspected:
    """Hold one equation's table, the questions that explain what is missing, and how much each does.

    missing: power beyond noise, in units of the equation's own size, as are the gains: force and
    torque on one scale.
    """

    table: Table
    keys: tuple[str, ...]
    gains: dict[str, float]
    missing: float


def inspected(case: Case, theta: Floats) -> list[Inspected]:
    """Return what explains the force and the torque that a twin with these words lacks."""
    case = thinned(case)
    here = along(case, theta)
    found = []
    for balance in balances(case, theta):
        table = table_of(case, here, balance, theta)
        keys = explanation(table)
        own = max(balance.size, 1e-300) ** 2
        shared = {key: gain / own for key, gain in gains(table, keys).items()}
        found.append(Inspected(table, keys, shared, missing_power(table, keys) / own))
    return found


def table_of(case: Case, here: Along, balance: Balance, theta: Floats) -> Table:
    """Return the table of all questions about a balance; waves are looked for in what the twin's own words leave."""
    rest = Table(balance, []).rest(())
    return Table(balance, [*asked_of(case, here, balance, theta), *waves(balance, here, rest)])


def asked_of(case: Case, here: Along, balance: Balance, theta: Floats) -> list[Question]:
    """Return all questions but those about waves."""
    return [
        *questions(here, balance),
        *past_questions(case.signals, here, balance, theta),
        *sensor_questions(case.signals, here, balance, theta),
    ]


def curves_of(one: Inspected, theta: Floats) -> list[Curve]:
    """Return the measured curves of what explains an equation."""
    return curves(one.table, one.keys, own_theta(one.table.balance.equation, theta))


def own_theta(equation: int, theta: Floats) -> dict[str, float]:
    """Return the twin's own words that stand in an equation, by the names of the balance's columns."""
    if equation == FORCE:
        own = {"drive": FORCE_PER_PWM, "viscous": CART_VISCOUS, "coupling": COUPLING}
    else:
        own = {"weight": MOMENT, "viscous": POLE_VISCOUS}
    return {name: float(theta[slot]) for name, slot in own.items()}

"""Ask a recording every question about a twin, and explain the force and torque that it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_sysid.finding.localisation.balance import (
    Balance,
    Motion,
    compute_motion,
    make_balances,
)
from pendulum_sysid.finding.localisation.explain import compute_missing_power, explain, share_gains
from pendulum_sysid.finding.localisation.measured_curves import MeasuredCurve, measure_curves
from pendulum_sysid.finding.localisation.past_questions import make_past_questions
from pendulum_sysid.finding.localisation.questions import Question, make_questions
from pendulum_sysid.finding.localisation.sensor_questions import make_sensor_questions
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.finding.localisation.waves import make_wave_questions
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
    """Hold what explains the missing part of one equation.

    Powers are in units of the equation's own size, which puts force and torque on one scale.

    table: of all questions.
    keys: of the questions that explain what is missing.
    gains: key -> power that the question explains.
    missing: power beyond the sensors' noise.
    """

    table: Table
    keys: tuple[str, ...]
    gains: dict[str, float]
    missing: float


def inspect_twins(case: Case, vectors: Sequence[Floats]) -> list[list[Inspected]]:
    """Return what explains the force and the torque that each twin lacks; equal twins once.

    vectors: (SIZE,) theta of each twin.
    """
    different = {theta.tobytes(): theta for theta in vectors}
    inspected = {key: inspect_twin(case, theta) for key, theta in different.items()}
    return [inspected[theta.tobytes()] for theta in vectors]


def inspect_twin(case: Case, theta: Floats) -> list[Inspected]:
    """Return what explains the force and the torque that a twin with this theta (SIZE,) lacks."""
    equations = []
    for table in make_tables(thin_out(case), theta, theta):
        keys = explain(table)
        own = max(table.balance.size**2, 1e-300)
        shared = {key: gain / own for key, gain in share_gains(table, keys).items()}
        equations.append(Inspected(table, keys, shared, compute_missing_power(table, keys) / own))
    return equations


def make_tables(case: Case, theta: Floats, seen_through: Floats) -> list[Table]:
    """Return the table of all questions about each equation for a twin with this theta (SIZE,).

    seen_through: (SIZE,) of the twin through which the motion is seen that questions are about.
    """
    here = compute_motion(case, seen_through)
    return [make_table(case, here, balance, theta) for balance in make_balances(case, theta)]


def make_table(case: Case, here: Motion, balance: Balance, theta: Floats) -> Table:
    """Return the table of all questions about a balance.

    Waves are looked for in what the twin's own constants leave.
    """
    residual = Table(balance, []).compute_residual(())
    return Table(
        balance,
        [
            *list_questions(case, here, balance, theta),
            *make_wave_questions(balance, here, residual),
        ],
    )


def list_questions(case: Case, here: Motion, balance: Balance, theta: Floats) -> list[Question]:
    """Return all questions but those about waves."""
    return [
        *make_questions(here, balance),
        *make_past_questions(case.signals, here, balance, theta),
        *make_sensor_questions(case.signals, here, balance, theta),
    ]


def measure_curves_of(inspected: Inspected, theta: Floats) -> list[MeasuredCurve]:
    """Return the measured curves of what explains an equation."""
    return measure_curves(
        inspected.table, inspected.keys, get_own_constants(inspected.table.balance.equation, theta)
    )


def get_own_constants(equation: int, theta: Floats) -> dict[str, float]:
    """Return the twin's constants that stand in an equation, by the names of its columns."""
    if equation == FORCE:
        own = {"drive": FORCE_PER_PWM, "viscous": CART_VISCOUS, "coupling": COUPLING}
    else:
        own = {"weight": MOMENT, "viscous": POLE_VISCOUS}
    return {name: float(theta[slot]) for name, slot in own.items()}

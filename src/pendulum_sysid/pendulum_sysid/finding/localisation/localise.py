"""Find where a mismatch lives, without the catalogue, by the force and torque that a twin lacks.

Each equation is asked what its missing part depends on (`inspection`): variables, products, the
past, sensors, the clock. Shares are of the missing power, beyond the sensors' noise, on samples
that did not make the curves; force and torque are counted on one scale, each in units of mass
(inertia) times acceleration, so that all shares add up.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.inspection import (
    Inspected,
    measure_curves_of,
)
from pendulum_sysid.finding.localisation.measured_curves import MeasuredCurve
from pendulum_sysid.fitting.stretches import join_stretches
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.records import Evidence, Localisation
from pendulum_twin.arrays import Floats

EQUATIONS = ("force", "torque")
AXIS_UNITS = {  # axis of a curve -> its unit; a command has that of its twin file
    "cart_position": "m",
    "cart_velocity": "m/s",
    "cart_acceleration": "m/s^2",
    "pole_angle": "rad",
    "pole_turns": "rad",
    "pole_rate": "rad/s",
    "time": "s",
    "way": "m",
    "turn": "rad",
}


def localise(equations: Sequence[Inspected], theta: Floats, runs: WindowRuns) -> Localisation:
    """Return where the twin with this theta (SIZE,), its signs right, falls short.

    equations: what explains the force and the torque that it lacks.
    runs: its free runs, for the stretches of the recording where it is worst.
    """
    total = sum(equation.missing for equation in equations)
    answers = [
        _make_evidence(equation, curve, equation.gains[curve.question.key] / total)
        for equation in equations
        if total > 0
        for curve in measure_curves_of(equation, theta)
    ]
    explained = min(sum(evidence.share for evidence in answers), 1.0)
    answers = sorted(
        (evidence for evidence in answers if evidence.share >= decisions.EVIDENCE_LEAST_SHARE),
        key=lambda evidence: -evidence.share,
    )
    return Localisation(
        _find_place(answers) or _find_worse_joint(runs),
        tuple(answers[: decisions.EVIDENCE_LINES]),
        find_worst_stretches(runs),
        explained,
    )


def _find_place(answers: list[Evidence]) -> str | None:
    """Return the place to which most of what is explained points."""
    shares: dict[str, float] = defaultdict(float)
    for evidence in answers:
        shares[evidence.place] += evidence.share
    return max(shares, key=lambda place: shares[place], default=None)


def _make_evidence(equation: Inspected, curve: MeasuredCurve, share: float) -> Evidence:
    question, what = curve.question, curve.question.measured
    name = EQUATIONS[equation.table.balance.equation]
    finding = (
        f"{share:.0%} of what is missing goes with it, in the {name}; {describe_curve(curve)}"
    )
    drawn = (curve.x, curve.y, curve.band) if len(curve.x) > 1 else (np.empty(0),) * 3
    return Evidence(
        question.variable,
        finding,
        share,
        *drawn,
        what.axis,
        what.quantity,
        what.unit,
        question.place,
    )


def describe_curve(curve: MeasuredCurve) -> str:
    """Return a measured curve in a phrase."""
    what, unit = curve.question.measured, f" {curve.question.measured.unit}".replace(" 1", "")
    if len(curve.x) == 1:
        return f"{what.quantity} {curve.y[0]:.3g}{unit} (+-{curve.band[0]:.1g})"
    if curve.question.variable == "frequency":
        hertz, amplitude = 1.0 / curve.x[-1], np.max(np.abs(curve.y))
        return f"a vibration of {hertz:.3g} Hz, amplitude {amplitude:.3g}{unit}"
    if curve.question.variable == "command_history":
        late = float(np.interp(0.5, np.maximum.accumulate(curve.y / curve.y[-1]), curve.x))
        return (
            f"half of the force of {curve.y[-1]:.3g} N per command has come {late:.2g} s after "
            "a step of it"
        )
    low, high = int(np.argmin(curve.y)), int(np.argmax(curve.y))
    first, last = (low, high) if curve.x[low] <= curve.x[high] else (high, low)
    at = f" {AXIS_UNITS.get(what.axis, '')}".rstrip()
    points = [
        f"{curve.y[k]:.3g}{unit} at {curve.x[k] + 0.0:.3g}{at}" for k in (first, last)
    ]  # + 0.0: no "-0"
    return f"{what.quantity} from {points[0]} to {points[1]}"


def _find_worse_joint(runs: WindowRuns) -> str:
    """Return the joint whose runs are the further off, in units of noise."""
    return ("cart", "pole")[runs.channels[int(np.argmax(runs.rmse / runs.noise))]]


def find_worst_stretches(runs: WindowRuns) -> tuple[tuple[float, float], ...]:
    """Return the stretches, s, where runs are far more wrong than in the median window."""
    errors = np.sqrt(np.mean((runs.window_rmse / runs.noise) ** 2, axis=1))
    far = errors > decisions.STRETCH_ERROR_RATIO * np.median(errors)
    return join_stretches(runs.begin_s[far], runs.seconds)

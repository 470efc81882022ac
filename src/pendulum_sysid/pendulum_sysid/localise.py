"""Where a mismatch lives, asked without the catalogue: the force and torque that the motion needs and the twin lacks.

The missing force (torque) is averaged over bins of one variable after another, each time the one that explains most of what
the ones before left; shares are of its power, measured on samples that did not make the averages, so that they add up and
noise has none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.case import Case
from pendulum_sysid.records import Evidence, Localisation
from pendulum_sysid.window_runs import WindowRuns
from pendulum_twin.inverse_dynamics import missing_force
from pendulum_twin.signals import Floats, Mask
from pendulum_twin.simulate import unmeasured
from pendulum_twin.words import COUPLING, INERTIA, MASS

BINS = 24
BLOCK_S = 0.5  # samples go to making and to measuring averages in blocks this long
LEAST_SHARE = 0.02
CLEAR = 2.0  # times the power that noise alone makes, to be asked about
MOST_EVIDENCE = 3
OUTSTANDING = 2.0  # times the median window's error, to be named as a stretch

# Which place of the chain a variable points to, by the equation whose force it explains.
FORCE_PLACES = {
    "command": "command",
    "command_rate": "drive",
    "cart_velocity": "cart",
    "cart_position": "cart",
    "pole_angle": "pole",
    "constant": "cart",
    "time": "drive",
}
TORQUE_PLACES = {
    "pole_rate": "pole",
    "pole_angle": "pole",
    "cart_acceleration": "sensor",
    "constant": "pole",
    "time": "pole",
}


@dataclass(frozen=True)
class Curve:
    """Hold a missing force averaged over bins of a variable: centres, means, half widths of 95 % intervals (bins,)."""

    x: Floats
    y: Floats
    band: Floats


def localise(case: Case, words: Floats, runs: WindowRuns) -> Localisation:
    """Return where the twin with these words, its signs right, falls short on the recording.

    runs: its free runs, for the stretches of the recording where it is worst.
    """
    lacking, usable = missing_force(case.signals, case.state.states, case.state.accelerations, words)
    variables = _variables(case, words)
    found: list[tuple[float, str, Evidence]] = []
    noise = _noise_of_missing(case, words)
    for column, there, places, unit in (
        (0, case.signals.cart, FORCE_PLACES, "N"),
        (1, case.signals.pole, TORQUE_PLACES, "N m"),
    ):
        if there is not None and np.mean(lacking[usable, column] ** 2) > CLEAR * noise[column] ** 2:
            found += _explained(case, lacking[:, column], usable, variables, places, unit)
    found.sort(key=lambda one: -one[0])
    place = found[0][1] if found else _worse_joint(runs)
    return Localisation(place, tuple(evidence for _, _, evidence in found[:MOST_EVIDENCE]), stretches(runs))


def _noise_of_missing(case: Case, words: Floats) -> Floats:
    """Return the deviation of missing force (N) and torque (N m) that the sensors' noise alone makes."""
    a, b = case.state.acceleration_deviations
    coupling = words[COUPLING]
    mass = words[MASS] if case.signals.cart is not None else 0.0
    return np.array([np.hypot(mass * a, coupling * b), np.hypot(words[INERTIA] * b, coupling * a)])


def _variables(case: Case, words: Floats) -> dict[str, Floats]:
    signals, state = case.signals, case.state
    x, th, v, w = unmeasured(state.states[None], words[None], signals.clock_s)[0].T
    return {
        "command": signals.command,
        "command_rate": np.gradient(signals.command) / signals.period_s,
        "cart_position": x,
        "cart_velocity": v,
        "cart_acceleration": state.accelerations[:, 0],
        "pole_angle": np.mod(th, 2 * np.pi),
        "pole_rate": w,
        "constant": np.ones(len(signals)),
        "time": np.arange(len(signals)) * signals.period_s,
    }


def _explained(
    case: Case, lacking: Floats, usable: Mask, variables: dict[str, Floats], places: dict[str, str], unit: str
) -> list[tuple[float, str, Evidence]]:
    """Return (share, place, evidence) of the variables that explain a missing force, one after another."""
    block = (np.arange(len(lacking)) * case.signals.period_s // BLOCK_S).astype(int) % 2 == 0
    rest, power = lacking[usable].copy(), float(np.mean(lacking[usable] ** 2))
    making = block[usable]
    found: list[tuple[float, str, Evidence]] = []
    left = dict(places)
    while left and len(found) < MOST_EVIDENCE and power > 0:
        asked = ["constant"] if "constant" in left else list(left)  # any variable that hardly changes would do for it
        tried = {name: _gain(variables[name][usable], rest, making) / power for name in asked}
        name = max(tried, key=lambda one: tried[one])
        if tried[name] < LEAST_SHARE:
            if left.pop("constant", None):
                continue
            break
        curve = averaged(variables[name][usable], rest)
        finding = f"explains {tried[name]:.0%} of the missing {'force' if unit == 'N' else 'torque'}; " + _shape(curve, unit)
        evidence = Evidence(name, finding, tried[name], curve.x, curve.y, curve.band)
        found.append((tried[name], left.pop(name), evidence))
        rest -= np.interp(variables[name][usable], curve.x, curve.y)
    return found


def _gain(variable: Floats, values: Floats, making: Mask) -> float:
    """Return by how much binned averages from one half of the samples reduce the power of the other half, both ways."""
    gains = []
    for half in (making, ~making):
        if half.sum() < BINS or (~half).sum() < BINS:
            return 0.0
        curve = averaged(variable[half], values[half])
        other = values[~half]
        gains.append(float(np.mean(other**2) - np.mean((other - np.interp(variable[~half], curve.x, curve.y)) ** 2)))
    return float(np.mean(gains))


def averaged(variable: Floats, values: Floats) -> Curve:
    """Return values averaged over bins of equal count along a variable, with 95 % intervals of the means."""
    edges = np.unique(np.quantile(variable, np.linspace(0, 1, BINS + 1)))
    bins = np.clip(np.searchsorted(edges, variable, side="right") - 1, 0, max(len(edges) - 2, 0))
    count = np.bincount(bins)
    kept = count > 1
    mean = np.bincount(bins, values)[kept] / count[kept]
    square = np.bincount(bins, values**2)[kept] / count[kept]
    spread = np.sqrt(np.maximum(square - mean**2, 0.0) / (count[kept] - 1))
    return Curve(np.bincount(bins, variable)[kept] / count[kept], mean, 1.96 * spread)


def _shape(curve: Curve, unit: str) -> str:
    low, high = int(np.argmin(curve.y)), int(np.argmax(curve.y))
    if len(curve.y) == 1:
        return f"{curve.y[0]:.3g} {unit} all the time"
    return f"from {curve.y[low]:.3g} {unit} at {curve.x[low]:.3g} to {curve.y[high]:.3g} {unit} at {curve.x[high]:.3g}"


def _worse_joint(runs: WindowRuns) -> str:
    """Return the joint whose runs are the further off, in units of noise, when no variable explains the missing force."""
    return ("cart", "pole")[runs.channels[int(np.argmax(runs.rmse / runs.noise))]]


def stretches(runs: WindowRuns) -> tuple[tuple[float, float], ...]:
    """Return where the runs are more than twice as wrong as in the median window, s, joined where they touch."""
    errors = np.sqrt(np.mean((runs.window_rmse / runs.noise) ** 2, axis=1))
    found: list[tuple[float, float]] = []
    for begin in np.sort(runs.begin_s[errors > OUTSTANDING * np.median(errors)]):
        end = float(begin) + runs.seconds
        if found and begin <= found[-1][1] + 1e-9:
            found[-1] = (found[-1][0], end)
        else:
            found.append((float(begin), end))
    return tuple(found)

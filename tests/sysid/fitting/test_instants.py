"""An instant is known no better than the windows that were fitted tell it."""

import numpy as np
import pytest
from support.hidden_physics import INTECO, record_hidden

from pendulum_sysid.finding.judge import compute_distance
from pendulum_sysid.finding.replication import widen_intervals
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import SLOTS, make_theta

LOAD = "load_put_on"
REST = {  # small physics that the fit does not know: 4 to 13 times the noise remains
    "rail_spring": {"n_per_m": 0.2, "centre_m": 0.05},
    "cogging": {"amplitude_n": 0.04, "period_m": 0.12, "phase_rad": 0.5},
}


def prepare_load(time_s: float) -> tuple[Prepared, Floats]:
    """Return a prepared recording of a load of 0.1 kg, and theta of the rig that it was put on."""
    effects = {LOAD: {"load_kg": 0.1, "time_s": time_s}}
    recording, truth = record_hidden(effects, 1, 20.0)
    return prepare([recording], INTECO), make_theta(truth)


def find_instant(inside: bool) -> float:
    """Return the middle, s, of a held-out window or a fitted window amid the recording."""
    split = prepare_load(10.0)[0].split
    windows = split.learn if inside else split.held_out
    begin = int(np.sort(windows.begin)[len(windows.begin) // 2])
    return 0.01 * (begin + 0.5 * (windows.samples - 1))


@pytest.mark.parametrize("inside", [True, False])
def test_an_instant_is_told_by_the_windows_that_hold_it(inside: bool) -> None:
    time_s = find_instant(inside)
    prepared, theta = prepare_load(time_s)
    theta[SLOTS[LOAD]] = 0.08, time_s + 0.03
    found = fit(prepared.case, prepared.split, (LOAD,), theta).estimates
    instant = found[f"{LOAD}.time_s"]
    assert instant.low <= time_s <= instant.high
    assert (instant.high - instant.low < 0.02) == inside
    assert found[f"{LOAD}.load_kg"].value == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize(("time_s", "is_told"), [(0.07, False), (10.0, True), (19.95, False)])
def test_an_instant_next_to_an_end_of_the_recording_tells_no_load(
    time_s: float, is_told: bool
) -> None:
    """There is no motion on its other side: the load would stand for a mass that is wrong."""
    prepared, theta = prepare_load(time_s)
    theta[SLOTS[LOAD]] = 0.1, time_s
    fitted = fit(prepared.case, prepared.split, (LOAD,), theta)
    assert (compute_distance(fitted, LOAD) > 1.0) == is_told


@pytest.mark.parametrize(("seed", "time_s"), [(5, 14.05), (3, 10.7)])
def test_beside_physics_that_the_fit_lacks_an_instant_is_told_by_the_errors(
    seed: int, time_s: float
) -> None:
    """The few windows that know an instant fit it to what the twin lacks."""
    effects = {LOAD: {"load_kg": 0.2, "time_s": time_s}, **REST}
    prepared = prepare([record_hidden(effects, seed, 24.0)[0]], INTECO)
    theta = make_theta(INTECO)
    theta[SLOTS[LOAD]] = 0.15, time_s + 0.1
    fitted = fit(prepared.case, prepared.split, (LOAD,), theta, 4)
    sandwich = fitted.estimates[f"{LOAD}.time_s"]
    assert not sandwich.low <= time_s <= sandwich.high
    widened = widen_intervals(prepared.case, prepared.split, fitted).estimates[f"{LOAD}.time_s"]
    assert widened.low <= time_s <= widened.high
    assert widened.high - widened.low < 1.0

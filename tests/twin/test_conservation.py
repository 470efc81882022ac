"""Energy: conserved without friction, never growing with any."""

import numpy as np
import pytest
from support.twin_rigs import FRICTIONLESS, POLE_ALONE, run

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.equations import compute_energy
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import COUPLING, GRAVITY, INERTIA, MASS, MOMENT, make_theta

START = (0.0, 0.5, 0.3, -4.0)
DISSIPATIVE = {
    "cart_coulomb_friction": {"level_n": 0.4},
    "cart_stribeck_friction": {"level_n": 0.2, "static_n": 0.3, "velocity_m_s": 0.05},
    "cart_saturating_friction": {"viscous_n_s_m": 1.2, "level_n": 0.1, "limit_n": 0.5},
    "cart_quadratic_drag": {"n_s2_m2": 0.8},
    "pole_coulomb_friction": {"level_n_m": 0.003},
    "pole_quadratic_drag": {"n_m_s2": 2e-4},
    "rail_friction_patch": {"level_n": 0.5, "centre_m": 0.0, "width_m": 0.02},
}


def compute_energies(rig, effects=None, start=START, seconds=10.0):
    theta = make_theta(Twin("test", rig))
    states = run(rig, np.zeros(round(seconds / 0.01)), effects, start)
    return compute_energy(
        *(theta[k] for k in (MASS, COUPLING, MOMENT, INERTIA, GRAVITY)), states.T
    )


@pytest.mark.parametrize("rig", [FRICTIONLESS, POLE_ALONE], ids=["cart and pole", "pole alone"])
def test_conserved_without_friction(rig):
    start = START if rig.has_cart else (0.0, 0.5, 0.0, -4.0)
    energy_j = compute_energies(rig, start=start)
    assert np.ptp(energy_j) < 1e-8 * abs(energy_j[0])


def test_every_law_that_takes_energy_out_is_asked():
    laws = {e.name for e in CATALOGUE if e.form is Form.DRY or e.name.endswith("_drag")}
    assert set(DISSIPATIVE) == laws


@pytest.mark.parametrize("name", DISSIPATIVE)
def test_never_grows_with_friction(name):
    energy_j = compute_energies(FRICTIONLESS, {name: DISSIPATIVE[name]})
    assert np.max(np.diff(energy_j)) < 1e-10
    assert energy_j[-1] < energy_j[0] - 1e-3


@pytest.mark.parametrize("ratio", [-0.6, 0.6])
def test_never_grows_with_lopsided_friction(ratio):
    effects = {
        "cart_coulomb_friction": {"level_n": 0.4},
        "cart_friction_asymmetry": {"ratio": ratio},
    }
    assert np.max(np.diff(compute_energies(FRICTIONLESS, effects))) < 1e-10


def test_momentum_along_the_rail_is_conserved_without_friction():
    states = run(FRICTIONLESS, np.zeros(1000), None, START)
    theta = make_theta(Twin("test", FRICTIONLESS))
    momentum = theta[MASS] * states[:, 2] - theta[COUPLING] * np.cos(states[:, 1]) * states[:, 3]
    assert np.ptp(momentum) < 1e-9

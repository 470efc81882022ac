"""The twin files that come with the repository load, are believed, and run."""

import numpy as np
import pytest
from support.paths import CONFIG

from pendulum_twin.inteco import load_twin_or_inteco
from pendulum_twin.model import load_twin
from pendulum_twin.stepper import Stepper


@pytest.mark.parametrize("name", ["inteco", "inteco_thesis"])
def test_twins_run(name: str) -> None:
    twin = load_twin(CONFIG / f"{name}.yaml")
    assert twin.name == name
    stepper = Stepper(twin, 0.01)
    states = np.array([stepper.step(0.3 * np.cos(0.06 * k)) for k in range(300)])
    assert np.all(np.isfinite(states))
    assert np.max(np.abs(states[:, 0])) > 0.02 and np.max(np.abs(states[:, 1] - np.pi)) > 0.1


def test_programs_without_a_twin_file_take_the_inteco_rig_of_the_repository() -> None:
    assert load_twin_or_inteco(None) == load_twin(CONFIG / "inteco.yaml")


def test_the_thesis_twin_stands_still_in_its_dead_zone() -> None:
    stepper = Stepper(load_twin(CONFIG / "inteco_thesis.yaml"), 0.01)
    assert np.array_equal(stepper.step(0.03), [0.0, np.pi, 0.0, 0.0])  # 0.19 N of 0.227 N
    for _ in range(50):
        stepper.step(0.3)
    assert stepper.state[0] > 0.01


def test_the_thesis_twin_is_table_5_with_the_inertia_of_table_1() -> None:
    thesis = load_twin(CONFIG / "inteco_thesis.yaml")
    assert thesis.rig.to_mapping() == {
        "cart_mass_kg": 0.572066,
        "pole_mass_kg": 0.119648,
        "com_distance_m": 0.019631,
        "pole_inertia_kg_m2": load_twin(CONFIG / "inteco.yaml").rig.pole_inertia_kg_m2,
        "gravity_m_s2": 9.826466,
        "force_per_pwm_n": 6.338787,
        "cart_viscous_n_s_m": 0.0,
        "pole_viscous_n_m_s": 27.6e-5,
        "rail_half_length_m": 0.9,
        "pwm_limit": 0.5,
    }

"""The public API: what `import pendulum_twin` gives, and `simulate` against the kernel itself."""

import doctest
import json
import subprocess
import sys
import xml.etree.ElementTree as ET
from types import SimpleNamespace

import numpy as np
import pytest
from support.paths import ROOT
from support.twin_rigs import CART_ALONE, POLE_ALONE, THESIS, wild_command

import pendulum_twin
from pendulum_twin import BadInputError, Simulation, Twin, simulate, simulation
from pendulum_twin.stepper import Stepper, make_resting_state

PERIOD_S = 0.01
COMMAND = wild_command(100)
T = np.arange(len(COMMAND)) * PERIOD_S
START = (0.1, 2.5, 0.2, -1.0)
EFFECTS = {
    "cart_coulomb_friction": {"level_n": 0.4},
    "input_delay": {"delay_s": 0.02},
    "angle_offset": {"angle_rad": 0.1},
    "velocity_filter": {"time_constant_s": 0.03},
}


def stack_states(run: Simulation) -> np.ndarray:
    return np.column_stack([run.cart, run.pole, run.cart_velocity, run.pole_velocity])


@pytest.mark.parametrize("module", [pendulum_twin, simulation], ids=lambda m: m.__name__)
def test_the_examples_of_the_docstrings_run(module):
    failed, tried = doctest.testmod(module)
    assert tried > 0
    assert failed == 0


def test_a_simulation_is_what_the_stepper_gives_sample_by_sample():
    twin = Twin("test", THESIS, EFFECTS)
    stepper = Stepper(twin, PERIOD_S, START, before=None)
    states = [stepper.state] + [stepper.step(u) for u in COMMAND[:-1]]
    run = simulate(twin, T, COMMAND, START)
    np.testing.assert_allclose(stack_states(run), states, rtol=0, atol=1e-9)
    assert np.array_equal(run.t, T)


def test_without_a_start_the_pole_hangs_at_rest_as_its_sensor_shows_it():
    twin = Twin("test", THESIS, EFFECTS)
    run = simulate(twin, T, np.zeros(len(T)))
    rest = make_resting_state(twin)
    assert rest[1] == pytest.approx(np.pi + 0.1)
    np.testing.assert_allclose(stack_states(run), np.tile(rest, (len(T), 1)), atol=1e-12)


def test_time_counts_from_the_first_sample():
    twin = Twin("test", THESIS, {"gain_drift": {"per_s": 0.5}})
    now, later = simulate(twin, T, COMMAND), simulate(twin, T + 1000.0, COMMAND)
    np.testing.assert_allclose(stack_states(now), stack_states(later), rtol=0, atol=1e-9)


@pytest.mark.parametrize("rig", [CART_ALONE, POLE_ALONE], ids=["cart alone", "pole alone"])
def test_a_joint_that_the_rig_does_not_have_keeps_its_velocity(rig):
    run = simulate(Twin("test", rig), T, np.zeros(len(T)), START)
    missing = run.pole_velocity if not rig.has_pole else run.cart_velocity
    np.testing.assert_allclose(missing, missing[0], rtol=1e-9)


def test_lists_will_do_as_well_as_arrays():
    twin = Twin("test", THESIS)
    from_lists = simulate(twin, T.tolist(), COMMAND.tolist(), list(START))
    assert (
        stack_states(from_lists).tobytes()
        == stack_states(simulate(twin, T, COMMAND, START)).tobytes()
    )


@pytest.mark.parametrize(
    ("t", "command", "start", "sentence"),
    [
        (T[:1], COMMAND[:1], None, "t: expected at least 2 times, found 1"),
        (T, COMMAND[:-1], None, "command: expected 100 values, one a time, found 99"),
        (T[::-1], COMMAND, None, "t: expected evenly spaced, rising times"),
        (T**2, COMMAND, None, "resample the command to an even grid"),
        (np.zeros(100), COMMAND, None, "t: expected evenly spaced, rising times"),
        (T, COMMAND * np.nan, None, "command: expected finite numbers, found NaN or infinity"),
        (T, ["fast"] * 100, None, "command: expected numbers, found ['fast', 'fast'"),
        (T[:, None], COMMAND, None, "t: expected numbers in a row, found the shape (100, 1)"),
        (T, COMMAND, (0.0, 1.0), "start: expected cart, pole, cart velocity and pole velocity"),
        (T, COMMAND, (0.0, np.inf, 0.0, 0.0), "start: expected finite numbers"),
    ],
)
def test_what_cannot_be_simulated_is_said_in_a_sentence(t, command, start, sentence):
    with pytest.raises(BadInputError) as error:
        simulate(Twin("test", THESIS), t, command, start)
    assert sentence in str(error.value)


def test_a_simulation_goes_into_a_dictionary():
    run = simulate(Twin("test", THESIS), T, COMMAND, START)
    content = json.loads(json.dumps(run.to_dict()))
    assert list(content) == ["t", "cart", "pole", "cart_velocity", "pole_velocity"]
    assert content["pole"] == run.pole.tolist()


def test_a_simulation_goes_into_a_data_frame(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=dict))
    run = simulate(Twin("test", THESIS), T, COMMAND, START)
    frame = run.to_frame()
    assert list(frame) == list(run.to_dict())
    assert frame["cart"] is run.cart


def test_without_pandas_a_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    run = simulate(Twin("test", THESIS), T, COMMAND)
    with pytest.raises(BadInputError, match="install pandas, or use to_dict"):
        run.to_frame()


def test_the_package_is_imported_without_the_compiler():
    """Twin files, the catalogue and command lines need no Numba, which takes a second to load."""
    code = "import sys, pendulum_twin; print('numba' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_every_name_that_the_package_offers_is_there():
    assert all(getattr(pendulum_twin, name) is not None for name in pendulum_twin.__all__)


def test_the_version_is_that_of_the_ros_package():
    root = ET.parse(ROOT / "src" / "pendulum_twin" / "package.xml").getroot()
    assert root.findtext("version") == pendulum_twin.__version__


def test_type_checkers_are_told_that_the_package_has_types():
    assert (ROOT / "src" / "pendulum_twin" / "pendulum_twin" / "py.typed").is_file()

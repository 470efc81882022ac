"""The URDF of a twin: `check_urdf` takes it, and MuJoCo moves it as the twin's equations say."""

import math
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.paths import CONFIG

from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper
from pendulum_twin.urdf import UNLIMITED, main, make_urdf

FILES = sorted(CONFIG.glob("*.yaml"))
INTECO = load_twin(CONFIG / "inteco.yaml")
HEAVY_LEVER = replace(
    INTECO.rig, pole_mass_kg=0.05
)  # 0.05 kg at 0.27 m would alone have more than Jp
POSITIVE = st.floats(0.05, 5.0)


def make_engine(twin: Twin) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return MuJoCo with the twin's URDF, in fine steps, and its state."""
    model = mujoco.MjModel.from_xml_string(make_urdf(twin))
    model.opt.timestep, model.opt.integrator = 2.5e-4, mujoco.mjtIntegrator.mjINT_RK4
    model.opt.gravity[2] = -twin.rig.gravity_m_s2
    return model, mujoco.MjData(model)


def run_by_engine(twin: Twin, start: tuple[float, ...], seconds: float) -> np.ndarray:
    """Return x, th, v, w every 10 ms of a run without command."""
    model, data = make_engine(twin)
    data.qpos[:], data.qvel[:] = start[:2], start[2:]
    states = []
    for _ in range(round(100 * seconds)):
        mujoco.mj_step(model, data, 40)
        states.append([*data.qpos, *data.qvel])
    return np.array(states)


def run_by_twin(twin: Twin, start: tuple[float, ...], seconds: float) -> np.ndarray:
    stepper = Stepper(twin, 0.01, start)
    return np.array([stepper.step(0.0) for _ in range(round(100 * seconds))])


def read_attributes(twin: Twin, path: str) -> dict[str, str]:
    element = ET.fromstring(make_urdf(twin)).find(path)
    assert element is not None, path
    return element.attrib


@pytest.mark.skipif(
    shutil.which("check_urdf") is None, reason="check_urdf is missing (Debian: liburdfdom-tools)"
)
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_check_urdf_passes(file: Path, tmp_path: Path) -> None:
    (tmp_path / "rig.urdf").write_text(make_urdf(load_twin(file)), encoding="utf-8")
    done = subprocess.run(
        ["check_urdf", tmp_path / "rig.urdf"],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert done.returncode == 0 and "Successfully Parsed" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_joints_are_those_of_joint_states(file: Path) -> None:
    twin = load_twin(file)
    joints = [joint.get("name") for joint in ET.fromstring(make_urdf(twin)).iter("joint")]
    assert joints == ["cart"] * twin.rig.has_cart + ["pole"] * twin.rig.has_pole
    assert make_engine(twin)[0].njnt == len(joints)


@pytest.mark.parametrize("rig", [INTECO.rig, HEAVY_LEVER], ids=["inteco", "heavy_lever"])
def test_an_engine_moves_it_as_the_twin_does(rig: Rig) -> None:
    twin, start = Twin("t", rig), (0.1, math.pi - 1.0, -0.4, 2.0)
    ours, theirs = run_by_twin(twin, start, 2.0), run_by_engine(twin, start, 2.0)
    assert np.ptp(ours[:, 0]) > 0.05 and np.ptp(ours[:, 1]) > 1.0
    np.testing.assert_allclose(theirs, ours, atol=1e-5)


@pytest.mark.parametrize("name", ["inteco", "free_swing"])
def test_a_small_swing_with_the_cart_locked_has_the_period_of_the_equations(name: str) -> None:
    rig = load_twin(CONFIG / f"{name}.yaml").rig
    locked = make_urdf(Twin("t", rig)).replace('type="prismatic"', 'type="fixed"')
    swing = swing_by_engine(locked, 0.01, 4.0)
    crossings = np.flatnonzero((swing[:-1] > 0) & (swing[1:] <= 0))
    exact = (crossings + swing[crossings] / (swing[crossings] - swing[crossings + 1])) * 0.001
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    period = 2 * math.pi * math.sqrt((rig.pole_inertia_kg_m2 or 0.0) / (moment * rig.gravity_m_s2))
    assert len(exact) > 2 and np.diff(exact) == pytest.approx(period, rel=2e-4)


def swing_by_engine(urdf: str, angle: float, seconds: float) -> np.ndarray:
    """Return th - pi every 1 ms of a pole let go at an angle from hanging."""
    model = mujoco.MjModel.from_xml_string(urdf)
    model.opt.timestep, model.opt.integrator = 2.5e-4, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    data.qpos[:] = math.pi + angle
    swing = []
    for _ in range(round(1000 * seconds)):
        mujoco.mj_step(model, data, 4)
        swing.append(data.qpos[0] - math.pi)
    return np.array(swing)


def test_a_positive_angle_is_counterclockwise() -> None:
    model, data = make_engine(INTECO)
    data.qpos[:] = 0.2, 0.5
    mujoco.mj_forward(model, data)
    x, y, z = data.body("pole_link").xipos - data.body("cart_link").xpos
    length = INTECO.rig.total_mass_kg * 0.01955717 / 0.12
    assert (x, y, z) == pytest.approx(
        (-length * math.sin(0.5), 0.0, length * math.cos(0.5))
    )  # x to the right, z up
    assert data.body("cart_link").xpos == pytest.approx((0.2, 0.0, 0.0))


@settings(max_examples=50, deadline=None)
@given(cart=POSITIVE, pole=POSITIVE, distance=st.floats(0.0, 1.0), radius=st.floats(0.01, 1.0))
def test_mass_lever_and_inertia_survive(
    cart: float, pole: float, distance: float, radius: float
) -> None:
    inertia = (cart + pole) * distance * radius + 1e-4
    assume(1.25 * (cart + pole) * distance**2 / inertia < 0.99)
    rig = replace(
        INTECO.rig,
        cart_mass_kg=cart,
        pole_mass_kg=pole,
        com_distance_m=distance,
        pole_inertia_kg_m2=inertia,
    )
    moment = rig.total_mass_kg * distance
    model, _ = make_engine(Twin("t", rig))
    masses = [model.body(name).mass[0] for name in ("cart_link", "pole_link")]
    centre = model.body("pole_link").ipos[2]
    assert sum(masses) == pytest.approx(rig.total_mass_kg) and min(masses) > 0
    assert masses[1] * centre == pytest.approx(moment, abs=1e-12)
    across = max(model.body("pole_link").inertia)
    assert across + moment * centre == pytest.approx(inertia)


def test_bodies_that_cannot_be_are_refused() -> None:
    with pytest.raises(
        BadInputError,
        match=r"pole_inertia_kg_m2: expected above 0\.000331 .* no bodies move like that",
    ):
        make_urdf(Twin("t", replace(INTECO.rig, pole_inertia_kg_m2=3.0e-4)))
    assert make_urdf(Twin("t", replace(INTECO.rig, pole_inertia_kg_m2=3.32e-4)))


def test_limits_are_those_of_the_twin_file() -> None:
    limits = {
        key: float(value)
        for key, value in read_attributes(INTECO, "joint[@name='cart']/limit").items()
    }
    assert (limits["lower"], limits["upper"], limits["effort"]) == (
        -0.9,
        0.9,
        pytest.approx(12.86 * 0.5),
    )
    assert limits["velocity"] == pytest.approx(math.sqrt(2 * 12.86 * 0.5 / 0.6923 * 1.8))
    unknown = read_attributes(load_twin(CONFIG / "emps.yaml"), "joint[@name='cart']/limit")
    assert {abs(float(value)) for value in unknown.values()} == {UNLIMITED}


def test_friction_is_that_of_the_twin_file() -> None:
    effects = {
        "cart_coulomb_friction": {"level_n": 0.7},
        "pole_coulomb_friction": {"level_n_m": 0.002},
    }
    twin = Twin("t", INTECO.rig, effects)
    assert read_attributes(twin, "joint[@name='cart']/dynamics") == {
        "damping": "0.5",
        "friction": "0.7",
    }
    assert read_attributes(twin, "joint[@name='pole']/dynamics") == {
        "damping": "0.00027344",
        "friction": "0.002",
    }


def test_a_name_with_markup_stays_a_name() -> None:
    assert (
        ET.fromstring(make_urdf(replace(INTECO, name='a <b> & "c"'))).get("name") == 'a <b> & "c"'
    )


def test_the_program_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(CONFIG / "inteco.yaml")]) == 0
    said = capsys.readouterr()
    assert (said.out, said.err) == (make_urdf(INTECO), "")


def test_the_program_says_in_a_sentence_what_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nowhere.yaml"]) == 1
    said = capsys.readouterr()
    assert (
        said.out == ""
        and said.err.startswith("twin_urdf: nowhere.yaml: expected a twin file")
        and said.err.count("\n") == 1
    )

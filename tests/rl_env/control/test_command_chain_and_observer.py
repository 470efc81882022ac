"""The classical controller's parts: command chain, forces, and the state behind sensors."""

import math

import numpy as np
import pytest

from pendulum_rl_env.control.observer import Observer
from pendulum_rl_env.control.rig_forces import compute_drive
from pendulum_rl_env.control.static_drive import make_static_drive
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_twin.encoders import Encoders
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.stepper import Stepper

RIG = load_twin("config/inteco.yaml").rig
CHAIN = {
    "input_sign_inverted": {},
    "input_dead_zone": {"width": 0.05},
    "input_saturation": {"limit": 0.3},
    "gain_asymmetry": {"ratio": -0.2},
    "gain_drift": {"per_s": 0.01},
}


@pytest.mark.parametrize("drive", [0.2, -0.1, 0.01, 0.0])
def test_a_drive_that_bends_is_asked_for_more(drive: float) -> None:
    bent = Twin("made", RIG, {"soft_saturation": {"limit": 0.3}})
    chain = make_static_drive(bent, 0.5)
    assert chain.compute_drive(chain.compute_pwm(drive)) == pytest.approx(drive, abs=1e-12)
    assert chain.compute_pwm(9.0) == 0.5


@pytest.mark.parametrize("drive", [0.2, -0.2, 0.01, -1e-6, 0.0])
def test_a_drive_that_can_be_had_is_had(drive: float) -> None:
    chain = make_static_drive(Twin("made", RIG, CHAIN), 0.5)
    assert chain.compute_drive(chain.compute_pwm(drive, 3.0), 3.0) == pytest.approx(
        drive, abs=1e-12
    )
    assert [chain.compute_drive(chain.compute_pwm(most)) for most in (9.0, -9.0)] == pytest.approx(
        [0.24, -0.36]
    )
    assert chain.reach == pytest.approx(0.24)


def test_the_chain_is_the_twins() -> None:
    twin = Twin("made", RIG, CHAIN)
    for pwm in (0.4, -0.4, 0.15, -0.15, 0.03):
        plain = Twin("plain", RIG, {})
        drive = make_static_drive(twin, 0.5).compute_drive(pwm)
        assert Stepper(twin, 0.001).step(pwm) == pytest.approx(
            Stepper(plain, 0.001).step(drive), abs=1e-7
        )


@pytest.mark.parametrize(
    "state", [(0.1, 0.3, 0.4, -2.0), (-0.2, 2.0, -0.8, 5.0), (0.0, 3.0, 0.5, 0.0)]
)
def test_the_drive_for_an_acceleration_gives_it(state: tuple[float, ...]) -> None:
    effects = {
        "cart_coulomb_friction": {"level_n": 1.0},
        "cogging": {"amplitude_n": 0.5, "period_m": 0.1, "phase_rad": 0.3},
        "force_ripple": {"ratio": 0.3, "period_m": 0.15, "phase_rad": 0.3},
        "rail_tilt": {"angle_rad": 0.02},
        "pole_spring": {"n_m_per_rad": 0.005},
    }
    twin = Twin("made", RIG, effects)
    drive = compute_drive(3.0, math.copysign(1.0, state[2]), np.array(state), make_theta(twin))
    after = Stepper(twin, 1e-4, state).step(drive)
    assert (after[2] - state[2]) / 1e-4 == pytest.approx(3.0, abs=0.02)


SENSORS = {
    "cart_sign_inverted": {},
    "angle_sign_inverted": {},
    "angle_offset": {"angle_rad": 0.1},
    "eccentric_encoder": {"sine_rad": 0.05, "cosine_rad": -0.1},
    "angle_scale": {"ratio": 0.05},
    "position_scale": {"ratio": -0.1},
    "velocity_filter": {"time_constant_s": 0.08},
    "input_delay": {"delay_s": 0.045},
    "motor_lag": {"time_constant_s": 0.03},
}


def test_the_observer_sees_the_truth_behind_sensors_and_predicts_through_the_drive() -> None:
    twin, bare = (
        Twin("made", RIG, SENSORS),
        {name: SENSORS[name] for name in ("input_delay", "motor_lag")},
    )
    rig = KernelTransport(twin, 0.03, Encoders(57e-6, 2 * math.pi / 4096))
    true = Stepper(
        Twin("bare", RIG, bare), 0.01, tuple(Observer(twin, 0.03).correct(rig.reset().state, 0.0))
    )
    observer, pwm = Observer(twin, 0.03, 0.03), 0.0
    observer.correct(rig.reset().state, 0.0)
    predicted = observer.predict(0.0)
    for k in range(60):
        state = observer.correct(rig.exchange(pwm).state, pwm)
        now = [true.step(pwm) for _ in range(3)][-1]
        assert predicted == pytest.approx(now, abs=0.06)
        assert state[:2] == pytest.approx(now[:2], abs=2e-3) and state[2:] == pytest.approx(
            now[2:], abs=0.06
        )
        pwm = 0.3 * math.sin(0.3 * k)
        predicted = observer.predict(pwm)


def test_a_twin_in_process_begins_at_true_rest_with_a_drive_that_was_still() -> None:
    twin = Twin(
        "made", RIG, {"angle_offset": {"angle_rad": 0.1}, "input_delay": {"delay_s": 0.06}}
    )
    rig = KernelTransport(twin, 0.03)
    for _ in range(2):
        assert rig.reset().state == pytest.approx([0.0, math.pi + 0.1, 0.0, 0.0])
        states = [rig.exchange(0.5).state for _ in range(3)]
        assert (
            states[1] == pytest.approx([0.0, math.pi + 0.1, 0.0, 0.0], abs=1e-12)
            and states[2][2] > 0.1
        )
    let_go = KernelTransport(twin, 0.03, aside_rad=-0.05)
    assert (
        let_go.reset().state[1] == pytest.approx(math.pi + 0.05)
        and let_go.exchange(0.0).state[3] > 0.01
    )

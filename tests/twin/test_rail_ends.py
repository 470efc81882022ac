"""The live twin's cart stops at the rail's ends; nothing else of its motion changes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.paths import CONFIG
from support.twin_rigs import THESIS

from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import COUPLING, INERTIA, make_theta
from pendulum_twin.rail_ends import Impact, find_end_m, stop_cart
from pendulum_twin.stepper import Stepper
from pendulum_twin.twin_health import describe_impact

PERIOD_S = 0.01
END_M = 0.9
RIG = replace(THESIS, rail_half_length_m=END_M)
TWIN = Twin("test", RIG)


def make_live(twin: Twin = TWIN) -> LiveTwin:
    return LiveTwin(twin, PERIOD_S, 0.2)


def drive(live: LiveTwin, pwm: float, steps: int) -> np.ndarray:
    states = []
    for _ in range(steps):
        live.commands.offer(pwm, 0)
        live.advance(0)
        states.append(live.state)
    return np.array(states)


@pytest.mark.parametrize("pwm", [0.5, -0.5])
def test_a_cart_that_is_pushed_on_stays_at_the_end(pwm: float) -> None:
    live = make_live()
    states = drive(live, pwm, 400)
    end = math.copysign(END_M, pwm)
    assert np.max(np.abs(states[:, 0])) == END_M
    assert states[-1, 0] == end and states[-1, 2] == 0.0
    assert live.impacts == 1 and live.last_impact.end_m == end
    assert live.last_impact.speed_m_s > 1.0
    assert abs(states[-1, 1] - math.pi) < 0.2, "the pole comes to hang beside the end"


def test_the_cart_comes_away_and_hits_again() -> None:
    live = make_live()
    drive(live, 0.5, 300)
    back = drive(live, -0.5, 300)
    assert back[-1, 0] == -END_M and live.impacts == 2


def test_of_a_contact_the_hardest_impact_is_kept() -> None:
    live = make_live(Twin("short", replace(RIG, rail_half_length_m=1e-4)))
    drive(live, 0.05, 3)
    gentle = live.last_impact.speed_m_s
    drive(live, 0.5, 3)
    hardest = live.last_impact.speed_m_s
    drive(live, 0.05, 3)
    assert live.impacts == 1 and live.last_impact.speed_m_s == hardest > 3.0 * gentle > 0.0


def test_the_angles_momentum_stays_and_energy_is_lost() -> None:
    theta = make_theta(TWIN)
    true = np.array([END_M + 0.01, 2.0, 1.5, -3.0])
    before = theta[INERTIA] * true[3] - theta[COUPLING] * math.cos(2.0) * true[2]
    assert stop_cart(true, theta, END_M) == Impact(END_M, 1.5)
    assert true.tolist() == pytest.approx([END_M, 2.0, 0.0, before / theta[INERTIA]])


def test_a_cart_on_its_way_back_keeps_its_velocity() -> None:
    true = np.array([-END_M - 0.01, 2.0, 0.3, 1.0])
    assert stop_cart(true, make_theta(TWIN), END_M) == Impact(-END_M, 0.0)
    assert true.tolist() == [-END_M, 2.0, 0.3, 1.0]


def test_on_the_rail_every_bit_is_the_free_runs() -> None:
    free, live = Stepper(TWIN, PERIOD_S), make_live()
    commands = [0.3 * math.cos(0.3 * k) for k in range(100)]
    expected = [free.step(command) for command in commands]
    found = [drive(live, command, 1)[0] for command in commands]
    assert np.array_equal(expected, found) and live.impacts == 0


def test_a_scaled_encoder_shows_the_end_scaled() -> None:
    live = make_live(Twin("test", RIG, {"position_scale": {"ratio": 0.1}}))
    assert drive(live, 0.5, 300)[-1, 0] == pytest.approx(1.1 * END_M)


def test_a_pole_alone_has_no_rail() -> None:
    assert find_end_m(load_twin(CONFIG / "free_swing.yaml").rig) == math.inf


def test_the_impact_is_said() -> None:
    assert describe_impact(Impact(-0.9, 1.234)) == (
        "the cart has hit the end of the rail at -0.9 m with 1.2 m/s and was stopped there"
    )

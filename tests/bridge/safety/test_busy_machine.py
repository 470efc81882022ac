"""A busy computer makes no encoder look stuck, and hides no encoder that is."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.busy_machine import draw_standstills, reset_on_busy_machine
from support.guarded_rigs import PERIOD_S, stepper, varied
from support.paths import CONFIG

from pendulum_bridge.safety.encoder_check import Encoders, check_sample, make_encoder_check
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import make_rules
from pendulum_twin.model import load_twin

NOMINAL = load_twin(CONFIG / "inteco.yaml").rig
CHECK = make_encoder_check(NOMINAL, 0.5, PERIOD_S)
REST = RigState(0.1, math.pi, 0.0, 0.0)
STUCK = (Reason.CART_STUCK, Reason.POLE_STUCK)


def follow(gaps_s: list[float], sample: RigState, pwm: float) -> Reason | None:
    encoders = Encoders()
    for gap_s in gaps_s:
        encoders = check_sample(encoders, sample, pwm, gap_s, CHECK)
    return encoders.fault


def test_a_rig_whose_process_is_starved_may_answer_late() -> None:
    """Each sample is a period of the rig's time, however long the computer took for it: 12 of
    them are the 0.12 s that a drive with a lag takes to overcome friction.
    """
    assert follow([0.09] * 12, REST, 0.4) is None
    assert follow([PERIOD_S] * 60, REST, 0.4) is Reason.CART_STUCK


def test_commands_may_act_late_after_a_standstill() -> None:
    """Whenever the lag might be over, the computer stands still again."""
    assert follow(([PERIOD_S] * 12 + [0.08]) * 10, REST, 0.4) is None


@pytest.mark.parametrize("gap_s", [0.0, 1e-5])
def test_a_burst_of_the_same_sample_is_no_time(gap_s: float) -> None:
    """A rig that repeats its last sample while it stands still, and a driver that reads late."""
    moving = replace(REST, cart_m_s=0.4, pole_rad_s=3.0)
    assert follow([PERIOD_S] + [gap_s] * 40, moving, 0.4) is None
    assert follow([PERIOD_S] * 40, moving, 0.0) in STUCK


@pytest.mark.parametrize("tiny", [5e-324, -5e-324, 1e-9])
def test_a_velocity_that_a_filter_leaves_is_no_motion(tiny: float) -> None:
    """0.6 * 5e-324 is 5e-324: a filtered velocity of a rig at rest never becomes 0."""
    assert 0.6 * 5e-324 == 5e-324
    resting = replace(REST, cart_m_s=tiny, pole_rad_s=tiny)
    assert follow([PERIOD_S] * 2000, resting, 0.0) is None


STANDSTILLS = {"rig": (True, False), "driver": (False, True), "both": (True, True)}


@pytest.mark.parametrize("who", STANDSTILLS)
def test_no_encoder_is_blamed_for_standstills(who: str) -> None:
    """0.5 N of dry friction, a drive that lags; the processes stand still for up to 95 ms."""
    rules = make_rules(NOMINAL, reset_deadline_s=6.0)
    effects = {
        "cart_coulomb_friction": {"level_n": 0.5},
        "motor_lag": {"time_constant_s": 0.05},
    }
    for seed in range(4):
        random = np.random.default_rng(seed)
        start = (*random.uniform((-0.75, 2, 0, 0), (0.75, 4, 0, 0)).tolist(),)
        stands = [
            draw_standstills(random, 10.0 if busy else 1e-3, 0.095) for busy in STANDSTILLS[who]
        ]
        ended = reset_on_busy_machine(stepper(NOMINAL, effects, start), rules, *stands)
        assert ended in (Reason.RESET_DONE, Reason.RESET_LATE, Reason.RESET_SILENT), f"{seed}"


@pytest.mark.parametrize("per_s", [1e-3, 4.0], ids=["calm", "busy"])
def test_a_dead_encoder_is_found_though_the_machine_is_busy(per_s: float) -> None:
    """From these starts the reset pushes harder than friction could hold."""
    rules = make_rules(NOMINAL)
    for seed in range(2, 6):
        random = np.random.default_rng(seed)
        start = (*random.uniform((-0.6, 2, 0, -8), (0.6, 4, 0, 8)).tolist(),)
        rig = stepper(NOMINAL, {"cart_coulomb_friction": {"level_n": 0.5}}, start)
        stands = [draw_standstills(random, per_s, 0.05) for _ in range(2)]
        assert reset_on_busy_machine(rig, rules, *stands, dead_after_s=0.15) in STUCK


def test_a_rig_that_catches_up_has_not_jumped() -> None:
    """The whole computer stands still; then the rig sends at once what it had to send meanwhile,
    and the driver decides on the newest sample alone: this start was an encoder that jumped.
    """
    random = np.random.default_rng(3)
    start = (*random.uniform((-0.6, -6, -0.5, -8), (0.6, 6, 0.5, 8)).tolist(),)
    rig = stepper(varied(NOMINAL, random), {"cart_coulomb_friction": {"level_n": 0.5}}, start)
    stands = draw_standstills(random, 3.0, 0.19)
    rules = make_rules(NOMINAL, reset_deadline_s=5.0)
    ended = reset_on_busy_machine(rig, rules, stands, stands)
    assert ended in (Reason.RESET_DONE, Reason.RESET_LATE)

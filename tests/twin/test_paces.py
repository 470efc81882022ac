"""Which sample answers which command, to the last bit, without ROS; and every effect live."""

import numpy as np
import pytest
from support.twin_rigs import HANGING, THESIS, run, wild_command
from twin.test_every_effect import choose_typical_values

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.paces import Lockstep, RealTime
from pendulum_twin.stepper import Stepper, make_resting_state

PERIOD_S, PERIOD_NS = 0.01, 10_000_000
TWIN = Twin(
    "test", THESIS, {"input_delay": {"delay_s": 0.015}, "cart_coulomb_friction": {"level_n": 1.0}}
)
COMMANDS = [0.0, 0.4, -0.3, 0.5, 0.1, -0.5, 0.2, 0.35, -0.25, 0.45]


class Outlet:
    """Keep what comes out."""

    def __init__(self) -> None:
        self.states: list[np.ndarray] = []
        self.stamps: list[int] = []
        self.pwm: list[float] = []

    def publish_sample(self, state: np.ndarray, stamp_ns: int) -> None:
        self.states.append(state.copy())
        self.stamps.append(stamp_ns)

    def publish_applied(self, pwm: float) -> None:
        self.pwm.append(pwm)


def make_live(pace: type, twin: Twin = TWIN, timeout_s: float = 0.2):
    outlet = Outlet()
    twin = LiveTwin(twin, PERIOD_S, timeout_s)
    return twin, pace(twin, PERIOD_S, outlet), outlet


def compute_trajectory(commands: list[float], twin: Twin = TWIN) -> np.ndarray:
    """Return the start state and the states after each command."""
    stepper = Stepper(twin, PERIOD_S)
    return np.array([stepper.state, *[stepper.step(command) for command in commands]])


def run_in_lockstep(commands: list[float], twin: Twin = TWIN) -> Outlet:
    _, pace, outlet = make_live(Lockstep, twin)
    pace.tick(0)
    assert all(pace.take_command(command, 0) for command in commands)
    return outlet


def run_in_real_time(commands: list[float]) -> Outlet:
    """Answer each sample within half a period."""
    _, pace, outlet = make_live(RealTime)
    for k, command in enumerate(commands):
        pace.tick(k * PERIOD_NS)
        pace.take_command(command, k * PERIOD_NS + PERIOD_NS // 4)
        pace.settle(k * PERIOD_NS + PERIOD_NS // 2)
    pace.tick(len(commands) * PERIOD_NS)
    return outlet


def test_in_lockstep_each_command_is_answered_by_the_next_sample() -> None:
    outlet = run_in_lockstep(COMMANDS)
    assert np.array(outlet.states).tobytes() == compute_trajectory(COMMANDS).tobytes()
    assert outlet.stamps == [k * PERIOD_NS for k in range(len(COMMANDS) + 1)]
    assert outlet.pwm == COMMANDS


def test_in_real_time_each_command_acts_from_the_sample_that_it_answers() -> None:
    outlet = run_in_real_time(COMMANDS)
    assert np.array(outlet.states).tobytes() == compute_trajectory(COMMANDS).tobytes()
    assert outlet.stamps == [k * PERIOD_NS for k in range(len(COMMANDS) + 1)]
    assert outlet.pwm == COMMANDS


def test_in_real_time_a_late_answer_acts_from_the_next_sample() -> None:
    _, pace, outlet = make_live(RealTime)
    pace.tick(0)
    pace.settle(PERIOD_NS // 2)
    pace.take_command(0.4, PERIOD_NS // 2 + 1)
    pace.tick(PERIOD_NS)
    pace.tick(2 * PERIOD_NS)  # on a machine that stood still, nobody settled in time
    assert outlet.pwm == [0.0, 0.4]
    assert np.array(outlet.states).tobytes() == compute_trajectory([0.0, 0.4]).tobytes()


@pytest.mark.parametrize("shift", [-1, 1])
def test_a_shift_by_one_step_shows(shift: int) -> None:
    # what the two tests above compare with differs at once when the commands come a step early or
    # late
    shifted = [*COMMANDS[1:], 0.0] if shift < 0 else [0.0, *COMMANDS[:-1]]
    assert not np.array_equal(compute_trajectory(COMMANDS)[:4], compute_trajectory(shifted)[:4])
    assert not np.array_equal(
        np.array(run_in_lockstep(COMMANDS).states), compute_trajectory(shifted)
    )
    assert not np.array_equal(
        np.array(run_in_real_time(COMMANDS).states), compute_trajectory(shifted)
    )


def test_the_last_command_before_a_sample_counts_in_real_time() -> None:
    _, pace, outlet = make_live(RealTime)
    pace.tick(0)
    for command in (0.1, 0.2, 0.3):
        pace.take_command(command, 1)
    pace.tick(PERIOD_NS)
    assert outlet.pwm == [0.3]


@pytest.mark.parametrize("pace", [Lockstep, RealTime])
def test_what_is_no_number_changes_nothing(pace: type) -> None:
    twin, run_, outlet = make_live(pace)
    run_.tick(0)
    before = len(outlet.states)
    assert not any(
        run_.take_command(bad, 0) for bad in (float("nan"), float("inf"), -float("inf"))
    )
    assert len(outlet.states) == before and twin.commands.refused == 3


def test_a_reset_in_lockstep_is_a_sample_of_the_start_and_time_goes_on() -> None:
    _, pace, outlet = make_live(Lockstep)
    pace.tick(0)
    for command in COMMANDS:
        pace.take_command(command, 0)
    pace.reset()
    for command in COMMANDS:
        pace.take_command(command, 0)
    ways = np.array(outlet.states).reshape(2, len(COMMANDS) + 1, 4)
    assert (
        ways[0].tobytes() == ways[1].tobytes()
    )  # nothing left of the first way, its delayed commands neither
    assert np.array_equal(ways[1][0], HANGING)
    assert set(np.diff(outlet.stamps)) == {PERIOD_NS}


def test_lockstep_starts_once() -> None:
    _, pace, outlet = make_live(Lockstep)
    pace.tick(0)
    pace.tick(PERIOD_NS)
    assert outlet.stamps == [0] and np.array_equal(outlet.states[0], HANGING)


def test_another_twin_goes_on_from_the_measured_state() -> None:
    other = Twin("other", THESIS, {"angle_offset": {"angle_rad": 0.1}, "cart_sign_inverted": {}})
    twin, pace, outlet = make_live(Lockstep)
    for command in COMMANDS:
        pace.take_command(command, 0)
    before = twin.state
    twin.become(other)
    assert twin.state == pytest.approx(before, abs=1e-12)
    pace.take_command(0.3, 0)
    expected = Stepper(other, PERIOD_S, tuple(before))
    assert outlet.states[-1].tobytes() == expected.step(0.3).tobytes()
    assert set(np.diff(outlet.stamps)) == {PERIOD_NS}


def test_another_twin_lets_the_last_command_through_its_delay() -> None:
    late = Twin("late", THESIS, {"input_delay": {"delay_s": 2 * PERIOD_S}})
    twin, pace, outlet = make_live(Lockstep)
    for command in (0.1, 0.4):
        pace.take_command(command, 0)
    before = twin.state
    twin.become(late)
    pace.take_command(-0.4, 0)
    expected = Stepper(late, PERIOD_S, tuple(before), before=0.4)
    assert outlet.states[-1].tobytes() == expected.step(-0.4).tobytes()


def test_another_twin_brings_its_own_limit() -> None:
    twin, pace, outlet = make_live(Lockstep)
    weak = Twin("weak", type(THESIS)(**(THESIS.to_mapping() | {"pwm_limit": 0.1})))
    pace.take_command(3.0, 0)
    twin.become(weak)
    pace.take_command(-3.0, 0)
    assert outlet.pwm == [3.0, -0.1]


def check_live(effect: Effect, effects: dict, live: np.ndarray, wanted: np.ndarray) -> None:
    """Check that a live twin shows the states of a run; of a late angle, what its rate tells."""
    if effect.form not in (Form.LATE, Form.LAGGING):
        assert live.tobytes() == wanted.tobytes()
        return
    (delay_s,) = effects[effect.name].values()
    order = 1.0 if effect.form is Form.LATE else 2.0  # a lag shows all of it, a delay half
    off = np.max(np.abs(live - wanted)[:, :2])
    rates = wanted[:, 3]
    assert off < order * delay_s**2 * np.max(np.abs(np.diff(rates))) / PERIOD_S
    assert off < 0.2 * order * delay_s * np.max(np.abs(rates))


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_every_effect_of_the_catalogue_runs_live_from_its_file(effect, tmp_path) -> None:
    others = {"cart_coulomb_friction": {"level_n": 0.5}} if effect.form is Form.DRY_RATIO else {}
    effects = others | choose_typical_values(effect)
    save_twin(Twin("live", THESIS, effects), tmp_path / "twin.yaml")
    twin = load_twin(tmp_path / "twin.yaml")
    lasting = twin.drop_recording_effects()
    commands = wild_command(60).tolist()
    outlet = run_in_lockstep(commands, twin)
    start = make_resting_state(lasting)
    wanted = run(lasting.rig, np.array(commands), lasting.effects, start)
    check_live(effect, effects, np.array(outlet.states[:-1]), wanted)
    running, pace, swapped = make_live(Lockstep, Twin("base", THESIS, others))
    running.become(twin)
    pace.tick(0)
    for command in commands:
        pace.take_command(command, 0)
    # it goes on from what was measured
    as_shown = run(lasting.rig, np.array(commands), lasting.effects, HANGING)
    check_live(effect, effects, np.array(swapped.states[:-1]), as_shown)

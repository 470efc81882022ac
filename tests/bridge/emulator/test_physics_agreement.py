"""Two engines that share no formula must move alike: MuJoCo here, the twin's kernel there."""

from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.concealable import BY_NAME, TABLE, Concealable
from pendulum_bridge.emulator.mjcf import compute_pole_body
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.session import play_plan
from pendulum_bridge.recording.bag_writer import Log
from pendulum_twin.errors import BadInputError
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.excitation import Excitation, make_standard_plan
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals

EXACT = Encoders(pole_counts=0, cart_step_m=0.0)
PERIOD_S = 0.01
HANGING = (0.0, np.pi, 0.0, 0.0)


def commands(seconds: float) -> np.ndarray:
    t = np.arange(round(seconds / PERIOD_S) + 1) * PERIOD_S
    return 0.1 * np.sin(2 * np.pi * 0.6 * t) + 0.05 * np.sin(2 * np.pi * 2.3 * t)


def emulated(rig: Rig, effects: dict, sent: np.ndarray, start=HANGING, timestep_s: float = 2.5e-4):
    """Return measured and true states, (samples, 4) each."""
    emulator = EmulatedRig(
        Concealed(effects, rig), 1 / PERIOD_S, EXACT, start=start, timestep_s=timestep_s
    )
    measured, true = [emulator.sample], [emulator.truth]
    for command in sent[:-1]:
        measured.append(emulator.step(command))
        true.append(emulator.truth)
    return np.array(measured), np.array(true)


def twinned(rig: Rig, effects: dict, sent: np.ndarray, start) -> np.ndarray:
    count = len(sent)
    seen = np.ones(count, dtype=bool)
    signals = Signals(PERIOD_S, sent, np.zeros(count), np.zeros(count), seen, seen)
    theta = make_theta(Twin("twin", rig, effects))[None]
    first = np.array([0])
    return run_freely(signals, theta, first, first, np.array([start]), count)[0]


def test_the_base_model_moves_as_in_the_twin(endless: Rig) -> None:
    sent = commands(20.0)
    start = (0.1, np.pi + 2.5, -0.2, 1.0)
    _, true = emulated(endless, {}, sent, start)
    twin = twinned(endless, {}, sent, start)
    assert np.max(np.abs(twin[:, 1] - np.pi)) > 2.0  # the pole did swing
    assert np.max(np.abs(true - twin)[:, :2]) < 1e-6
    assert np.max(np.abs(true - twin)[:, 2:]) < 1e-5


def test_the_difference_shrinks_with_the_time_step(endless: Rig) -> None:
    sent = commands(5.0)
    start = (0.0, np.pi + 2.5, 0.0, 0.0)
    _, finest = emulated(endless, {}, sent, start, 1.25e-4)
    errors = [
        np.max(np.abs(emulated(endless, {}, sent, start, h)[1] - finest))
        for h in (5e-3, 2.5e-3, 1.25e-3)
    ]
    assert errors[0] / errors[1] > 6
    assert errors[1] / errors[2] > 6


# m, rad: the catalogue leaves out what the cart gives the pole, and holds over a step of the
# kernel what the cart does to the motor
APPROXIMATE = {"cart_load_friction": 3e-3, "stretching_belt": 4e-5}
# what is late shows the start for a while: there it must be at rest
BEGINS = {"sensor_delay": HANGING, "angle_delay": HANGING, "angle_lag": HANGING}


@pytest.mark.parametrize(
    "chosen",
    [effect for effect in TABLE if effect.name != "stale_start"],
    ids=lambda effect: effect.name,
)
def test_every_effect_acts_as_the_catalogue_says(chosen: Concealable, endless: Rig) -> None:
    """Dry friction differs most (first order where a joint reverses), then the tilt (its sine)."""
    sent = commands(5.0)
    effects = {
        chosen.name: {name: 0.3 * span[0] + 0.7 * span[1] for name, span in chosen.sizes.items()}
    }
    if chosen.beside:
        effects[chosen.beside[0]] = {"level_n": 0.8}
    if chosen.name in ("encoder_slip", "load_put_on"):
        effects[chosen.name]["time_s"] = 2.5
    if chosen.name == "drive_slew_limit":  # the run's fastest command takes 0.9 s to 1
        effects[chosen.name]["ramp_s"] = 2.0
    if chosen.name == "motor_current_limit":  # the run stays below the limits that are concealed
        effects[chosen.name] = {"limit": 0.06, "counter_share": 0.9}
    start = BEGINS.get(chosen.name, (0.0, np.pi + 0.8, 0.0, 0.0))
    measured, _ = emulated(endless, effects, sent, start)
    twin = twinned(endless, effects, sent, tuple(measured[0]))
    without, _ = emulated(endless, {}, sent, start)
    if chosen.name in (
        "input_saturation",
        "velocity_filter",
    ):  # the run above stays below its limit; no position is filtered
        assert np.array_equal(measured[:, :2], without[:, :2])
        return
    assert np.max(np.abs(measured - without)[:, :2]) > 2e-3
    coarse = chosen.name == "rail_tilt" or "friction" in chosen.name
    allowed = 1e-3 if coarse else 1e-5
    assert np.max(np.abs(measured - twin)[:, :2]) < APPROXIMATE.get(chosen.name, allowed)


def test_velocities_are_filtered_as_the_catalogue_says(endless: Rig) -> None:
    """Emulated velocities are differences, half a period late; the filter makes them agree."""
    sent, effects = commands(5.0), {"velocity_filter": {"time_constant_s": 0.06}}
    measured, _ = emulated(endless, effects, sent)
    twin, plain = (twinned(endless, effect, sent, tuple(measured[0])) for effect in (effects, {}))
    middle = 0.5 * (twin[1:] + twin[:-1])[50:, 2:]
    assert np.max(np.abs(measured[51:, 2:] - middle)) < 0.02 * np.max(np.abs(middle))
    assert np.max(np.abs(measured[51:, 2:] - plain[51:, 2:])) > 0.1 * np.max(np.abs(middle))


def test_a_stale_start_is_followed_by_the_run_of_the_catalogue(endless: Rig) -> None:
    sent, effects = commands(3.0), {"stale_start": {"seconds": 0.6}}
    measured, _ = emulated(endless, effects, sent)
    twin = twinned(endless, effects, sent, HANGING)
    assert np.max(np.abs(measured - twin)[60:, :2]) < 1e-5 and np.ptp(measured[60:, 0]) > 0.01


def test_several_effects_at_once_act_in_the_catalogues_order(endless: Rig) -> None:
    names = (
        "gain_asymmetry",
        "motor_lag",
        "belt_backlash",
        "cogging",
        "pole_imbalance",
        "encoder_slip",
        "angle_scale",
    )
    more = (
        "position_scale",
        "angle_sign_inverted",
        "sample_period_error",
        "input_dead_zone",
        "gain_drift",
    )
    effects = {
        name: {key: sum(span) / 2 for key, span in BY_NAME[name].sizes.items()}
        for name in (*names, *more)
    }
    effects["encoder_slip"]["time_s"] = 1.234
    sent = commands(3.0)
    measured, _ = emulated(endless, effects, sent, (0.0, np.pi + 0.8, 0.0, 0.0))
    twin = twinned(endless, effects, sent, tuple(measured[0]))
    # lag, dead zone and gap each cross their edges within a step; another order is off by more
    # than 1e-3
    assert np.max(np.abs(measured - twin)[:, :2]) < 3e-4


@pytest.mark.parametrize(
    "name",
    ["motor_lag", "cart_coulomb_friction", "cart_stribeck_friction", "pole_coulomb_friction"],
)
def test_a_twin_that_knows_all_explains_a_recording_to_the_encoders_step(
    name: str, nominal: Rig
) -> None:
    """Free runs of a second from the true states differ by rounding, in all but a few windows."""
    effects = {name: {key: sum(span) / 2 for key, span in BY_NAME[name].sizes.items()}}
    whole, half = make_standard_plan(seconds=40, seed=2), 2000  # samples
    plan = replace(whole, commands=whole.commands[:half], centring=whole.centring[:half])
    true, log = states_along(EmulatedRig(Concealed(effects, nominal)), plan)
    seen = np.ones(len(true), dtype=bool)
    signals = Signals(PERIOD_S, log.commands, *log.positions.T, seen, seen)
    begin = np.arange(0, len(true) - 101, 50)
    theta = make_theta(Twin("twin", nominal, effects))[None]
    runs = run_freely(signals, theta, np.zeros(len(begin), dtype=int), begin, true[begin], 101)[
        :, :, :2
    ]
    errors = np.array(
        [run - log.positions[k : k + 101] for run, k in zip(runs, begin, strict=True)]
    )
    rounding = np.array([57e-6, 2 * np.pi / 4096]) / np.sqrt(12)
    windows = np.sqrt(np.mean(errors**2, axis=1)) / rounding
    assert np.all(np.median(windows, axis=0) < 1.1)
    assert np.all(np.quantile(windows, 0.95, axis=0) < 2)


def states_along(rig: EmulatedRig, plan: Excitation) -> tuple[np.ndarray, Log]:
    """Return the true states (samples, 4) along a played plan, and its log."""
    true = []

    class Watched:
        period_s = rig.period_s
        stale_samples = rig.stale_samples

        @property
        def sample(self) -> np.ndarray:
            return rig.sample

        def step(self, command: float) -> np.ndarray:
            true.append(rig.truth)
            return rig.step(command)

    log = play_plan(Watched(), plan)
    return np.array(true), log


def test_a_positive_command_pushes_the_cart_along_the_rail_and_the_pole_lags(nominal: Rig) -> None:
    true = emulated(nominal, {}, np.full(6, 0.2))[1][-1]
    assert true[0] > 0 and true[2] > 0
    assert (
        true[1] < np.pi
    )  # hanging, the pole's end stays behind: it turns clockwise seen from the front


def test_a_leaning_pole_falls_the_way_it_leans(nominal: Rig) -> None:
    true = emulated(nominal, {}, np.zeros(20), (0.0, 0.05, 0.0, 0.0))[1][-1]
    assert true[1] > 0.05 and true[3] > 0
    assert true[2] > 0  # its centre falls to the left, so the cart is pushed to the right


def test_the_cart_stops_at_the_end_of_the_rail(nominal: Rig) -> None:
    _, true = emulated(nominal, {}, np.full(200, 0.2))
    assert np.max(true[:, 0]) < 1.02 * nominal.rail_half_length_m


def test_a_pole_mass_too_light_for_its_moment_is_made_up_from_the_cart(endless: Rig) -> None:
    light = replace(endless, cart_mass_kg=0.6423, pole_mass_kg=0.05)
    mass, centre, inertia = compute_pole_body(light)
    assert mass > 0.05 and inertia > 0
    assert inertia + mass * centre**2 == pytest.approx(light.pole_inertia_kg_m2)
    start = (0.0, np.pi + 1.0, 0.0, 0.0)
    sent = commands(2.0)
    assert emulated(light, {}, sent, start)[1] == pytest.approx(
        twinned(light, {}, sent, start), abs=1e-6
    )


def test_impossible_bodies_are_refused(endless: Rig) -> None:
    with pytest.raises(
        BadInputError, match=r"pole_inertia_kg_m2: expected more than .* no bodies move like that"
    ):
        EmulatedRig(Concealed({}, replace(endless, pole_inertia_kg_m2=1e-4)))


def test_a_rig_without_a_pole_is_refused() -> None:
    cart = Rig(cart_mass_kg=1.0, force_per_pwm_n=10.0, cart_viscous_n_s_m=0.1)
    with pytest.raises(BadInputError, match="expected a rig with cart and pole"):
        EmulatedRig(Concealed({}, cart))

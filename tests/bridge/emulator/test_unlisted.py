"""Physics that no catalogue holds: each piece does what its row says, at its place."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.conceal import conceal_effects, draw_sizes
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed, open_seal, write_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.unlisted.table import BY_NAME, TABLE, Unlisted
from pendulum_twin.effects import BY_NAME as CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

EXACT = Encoders(pole_counts=0, cart_step_m=0.0)
MASS, FORCE, INERTIA, MOMENT = 0.6923, 12.86, 0.00292, 0.6923 * 0.01955717
ADDS = {"command": {"gain"}, "drive": {"gain"}, "cart": {"push", "level"}, "pole": {"twist"},
        "sensor": {"shown"},
        "clock": {"pace"}}  # fmt: skip


@pytest.fixture
def apart(endless: Rig) -> Rig:
    return replace(endless, com_distance_m=0.0, cart_viscous_n_s_m=0.0, pole_viscous_n_m_s=0.0)


def middle(effect: Unlisted) -> dict[str, float]:
    return {name: sum(span) / 2 for name, span in effect.sizes.items()}


@pytest.mark.parametrize("effect", TABLE, ids=lambda effect: effect.name)
def test_it_acts_at_its_place_and_is_in_no_catalogue(effect: Unlisted, nominal: Rig) -> None:
    extra = effect.make(nominal, **middle(effect))
    laws = {
        name
        for name in ("gain", "push", "twist", "level", "shown", "pace")
        if getattr(extra, name) is not None
    }
    assert len(laws) == 1 and laws <= ADDS[effect.place]
    assert effect.name not in CATALOGUE and effect.variables


@pytest.fixture(scope="module")
def without(nominal: Rig) -> np.ndarray:
    return moved(replace(nominal, rail_half_length_m=1000.0), {})


@pytest.mark.parametrize("effect", TABLE, ids=lambda effect: effect.name)
def test_it_is_clearly_seen(effect: Unlisted, endless: Rig, without: np.ndarray) -> None:
    """At its smallest, within seconds, by many encoder steps; and at nothing it is nothing."""
    smallest = {name: low for name, (low, _) in effect.sizes.items()}
    nothing = {name: value if name in effect.shapes else 0.0 for name, value in smallest.items()}
    with_it, gone = moved(endless, {effect.name: smallest}), moved(endless, {effect.name: nothing})
    assert np.max(np.abs(with_it - without) / [57e-6, math.tau / 4096]) > 20
    assert np.max(np.abs(gone - without)) < 1e-6


def moved(rig: Rig, unlisted: dict, seconds: float = 4.0) -> np.ndarray:
    emulator = EmulatedRig(
        Concealed({}, rig, unlisted), encoders=EXACT, start=(0.0, math.pi + 0.8, 0.0, 0.0)
    )
    t = np.arange(round(seconds * 100)) * 0.01
    commands = 0.3 * np.cos(math.tau * 1.3 * t) + 0.05 * np.cos(math.tau * 0.4 * t)
    return np.array([emulator.step(command)[:2] for command in commands])


def accelerations(
    rig: Rig, name: str, parameters: dict, start: tuple, command: float = 0.0, until_s: float = 0.0
):
    """Return the accelerations (m/s^2, rad/s^2) at `start` in the millisecond after until_s."""
    emulator = EmulatedRig(Concealed({}, rig, {name: parameters}), 1000.0, EXACT, start=start)
    for _ in range(round(until_s * 1000)):
        emulator.step(0.0)
    emulator._engine.put(start)
    before = emulator.truth
    emulator.step(command)
    return (emulator.truth - before)[2:] * 1000


@pytest.mark.parametrize(
    ("name", "parameters", "start", "command", "until_s", "force_n"),
    [
        ("gain_along_rail", {"per_m": 0.5}, (0.4, 0, 0, 0), 0.1, 0, 1.2 * 0.1 * FORCE),
        ("gain_falling_with_speed", {"s_per_m": 0.3}, (0, 0, -1.0, 0), 0.1, 0, 0.7 * 0.1 * FORCE),
        ("gain_falling_with_speed", {"s_per_m": 0.3}, (0, 0, 9.0, 0), 0.1, 0, 0.0),
        (
            "supply_ripple",
            {"ratio": 0.2, "frequency_hz": 0.5, "phase_rad": 0.0},
            (0, 0, 0, 0),
            0.1,
            0.5,
            1.2 * 0.1 * FORCE,
        ),
        (
            "crossover_amplifier",
            {"share": 0.5, "width": 0.1},
            (0, 0, 0, 0),
            0.1,
            0,
            (1 - 0.5 / math.e) * 0.1 * FORCE,
        ),
        ("warming_friction", {"n_per_s": 2.0}, (0, 0, 1.0, 0), 0.0, 0.4, -0.8),
        ("half_rail_friction", {"level_n": 0.7, "from_m": 0.1}, (0.2, 0, -1.0, 0), 0.0, 0, 0.7),
        ("half_rail_friction", {"level_n": 0.7, "from_m": 0.1}, (0.05, 0, -1.0, 0), 0.0, 0, 0.0),
        ("drag_chain", {"n_per_m3": 20.0}, (-0.5, 0, 0, 0), 0.0, 0, 2.5),
        ("outward_brake", {"n_s_per_m": 2.0}, (-0.3, 0, -1.0, 0), 0.0, 0, 2.0),
        ("outward_brake", {"n_s_per_m": 2.0}, (-0.3, 0, 1.0, 0), 0.0, 0, 0.0),
        ("hanging_cable", {"n_s_per_m2": 2.0}, (0.3, 0, 1.5, 0), 0.0, 0, -0.9),
    ],
)
def test_forces_on_the_cart(
    name, parameters, start, command, until_s, force_n, apart: Rig
) -> None:
    change, turning = accelerations(apart, name, parameters, start, command, until_s)
    assert change * MASS == pytest.approx(force_n, rel=6e-3, abs=1e-6) and abs(turning) < 1e-6


@pytest.mark.parametrize(
    ("name", "parameters", "start", "torque_n_m"),
    [
        (
            "bearing_notch",
            {"torque_n_m": 0.01, "phase_rad": 0.2},
            (0, 1.0, 0, 0),
            0.01 * math.sin(3.2),
        ),
        ("air_jet", {"torque_n_m": -0.01}, (0, 2.0, 0, 0), -0.01),
        ("stirred_air", {"n_s2": 0.001}, (0, 0, -2.0, 5.0), -0.01),
        ("stirred_air", {"n_s2": 0.001}, (0, 0, 0.0, 5.0), 0.0),
    ],
)
def test_torques_on_the_pole(name, parameters, start, torque_n_m, apart: Rig) -> None:
    pushed, change = accelerations(apart, name, parameters, start)
    assert change * INERTIA == pytest.approx(torque_n_m, rel=5e-3, abs=1e-6) and abs(pushed) < 1e-6


def test_a_cart_is_fanned_by_the_pole_and_by_nothing_else(nominal: Rig) -> None:
    push = BY_NAME["fanned_cart"].make(nominal, n_s2_per_m=0.5).push
    assert push is not None and push(0, 0, 0, 0.4, -10.0) == pytest.approx(-2.0)
    assert push(0, 0, 0, 0.4, 0.0) == push(0, 0, 0, 0.0, 10.0) == 0.0


def test_hysteresis_springs_back_and_then_drags(nominal: Rig) -> None:
    twist = BY_NAME["bearing_hysteresis"].make(nominal, n_m_per_rad=0.01, width_rad=0.4).twist
    assert twist is not None
    torques = [twist(0, 0, th, 0, 0) for th in (1.0, 1.2, 2.0, 1.8, 1.2, 0.0)]
    assert torques == pytest.approx([0.0, -0.002, -0.004, -0.002, 0.004, 0.004])


def test_sensors_run_ahead_and_behind(apart: Rig) -> None:
    wobbling = {"wobbling_disc": {"amplitude_rad": 0.05, "phase_rad": 0.3}}
    still = EmulatedRig(Concealed({}, apart, wobbling), encoders=EXACT, start=(0.1, 2.0, 0.0, 0.0))
    assert still.sample[:2] == pytest.approx([0.1, 2.0 + 0.05 * math.sin(4.3)])
    kinked = {"kinked_tape": {"per_m": 0.1, "from_m": 0.05}}
    still = EmulatedRig(Concealed({}, apart, kinked), encoders=EXACT, start=(0.25, 2.0, 0.0, 0.0))
    assert still.sample[:2] == pytest.approx([0.27, 2.0])


def test_a_wandering_clock_comes_back(apart: Rig) -> None:
    wander = {"clock_wander": {"ratio": 0.1, "period_s": 2.0, "phase_rad": 0.0}}
    emulator = EmulatedRig(
        Concealed({}, apart, wander), encoders=EXACT, start=(0.0, math.pi, 1.0, 0.0)
    )
    shown_m = np.array([emulator.step(0.0)[0] for _ in range(200)])
    assert shown_m[99] == pytest.approx(
        1 + 0.1 * 2 / math.pi, rel=1e-4
    )  # a half wave fast: its area ahead
    assert shown_m[199] == pytest.approx(2.0, rel=1e-4)


def test_sizes_are_drawn_within_the_table_and_scaled_but_for_shapes(nominal: Rig) -> None:
    for effect in TABLE:
        for seed in range(20):
            full, half = (
                draw_sizes(effect, np.random.default_rng(seed), factor) for factor in (1.0, 0.5)
            )
            for name, (low, high) in effect.sizes.items():
                assert low <= (abs(full[name]) if effect.both_ways else full[name]) <= high
                assert half[name] == pytest.approx(
                    full[name] * (1.0 if name in effect.shapes else 0.5)
                )


def test_a_seal_keeps_place_variables_and_sizes(nominal: Rig, tmp_path) -> None:
    concealed = conceal_effects(("hanging_cable", "input_delay"), 3, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    assert open_seal(tmp_path / "seal.json") == concealed and set(concealed.unlisted) == {
        "hanging_cable"
    }
    assert '"cart_position"' in (tmp_path / "seal.json").read_text()


def test_unknown_physics_is_refused(nominal: Rig) -> None:
    with pytest.raises(
        BadInputError, match="unlisted: unknown effect ghost; known are gain_along_rail"
    ):
        Concealed({}, nominal, {"ghost": {}})
    with pytest.raises(BadInputError, match="air_jet: expected torque_n_m, found level_n"):
        Concealed({}, nominal, {"air_jet": {"level_n": 1.0}})

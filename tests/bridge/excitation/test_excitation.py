"""The standard excitation tells much and keeps the cart on the rail, whatever is concealed."""

import numpy as np
import pytest

from pendulum_bridge.emulator.conceal import (
    LARGEST_PERTURBATION,
    PERTURBED_CONSTANTS,
    draw_concealed,
)
from pendulum_bridge.emulator.concealable import TABLE, Concealable
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.session import play_plan
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.excitation import (
    Envelope,
    compute_command,
    find_command_direction,
    make_standard_plan,
)
from pendulum_twin.rig import Rig


@pytest.fixture(scope="module")
def log(nominal: Rig):
    return play_plan(EmulatedRig(Concealed({}, nominal), timestep_s=1e-3), make_standard_plan())


def reversals(velocity: np.ndarray) -> int:
    return int(np.sum(np.diff(np.sign(velocity[np.abs(velocity) > 0.02])) != 0))


def test_it_excites_well(log) -> None:
    cart, pole = log.positions.T
    assert len(log.commands) == 6000
    assert np.max(np.abs(pole - np.pi)) > np.pi / 2
    assert np.mean(np.abs(log.commands) > 0.4) > 0.05  # up to the limit
    assert (
        np.mean((np.abs(log.commands) > 0.01) & (np.abs(log.commands) < 0.1)) > 0.15
    )  # and quiet
    assert np.mean(log.commands == 0) > 0.1  # rests
    assert reversals(log.velocities[:, 0]) > 80
    assert np.max(np.abs(cart)) > 0.3


def largest(chosen: Concealable) -> dict:
    return {chosen.name: {name: high for name, (_, high) in chosen.sizes.items()}}


@pytest.mark.parametrize("chosen", TABLE, ids=lambda effect: effect.name)
def test_the_cart_stays_on_the_rail_and_commands_in_the_limit(
    chosen: Concealable, nominal: Rig
) -> None:
    """With every effect at its largest, in a rig with a stronger push and a weaker brake."""
    signs = {
        name: -1 if name in ("cart_viscous_n_s_m", "pole_viscous_n_m_s") else 1
        for name in PERTURBED_CONSTANTS
    }
    lively = {
        name: getattr(nominal, name) * (1 + sign * LARGEST_PERTURBATION)
        for name, sign in signs.items()
    }
    rig = Rig(**{**nominal.to_mapping(), **lively})
    emulator = EmulatedRig(Concealed(largest(chosen), rig), timestep_s=2e-3)
    kept = play_plan(emulator, make_standard_plan(seed=1))
    assert np.max(np.abs(kept.positions[:, 0])) < 0.95 * rig.rail_half_length_m
    assert np.max(np.abs(kept.commands)) <= rig.pwm_limit


@pytest.mark.parametrize("seed", range(2))
def test_three_effects_at_once_stay_on_the_rail(seed: int, nominal: Rig) -> None:
    kept = play_plan(
        EmulatedRig(draw_concealed(seed, 3, nominal), timestep_s=2e-3),
        make_standard_plan(seed=seed),
    )
    assert np.max(np.abs(kept.positions[:, 0])) < 0.95 * nominal.rail_half_length_m


def test_the_same_seed_gives_the_same_recording(nominal: Rig) -> None:
    first, again, other = (
        play_plan(
            EmulatedRig(draw_concealed(seed, 1, nominal), timestep_s=2e-3),
            make_standard_plan(seconds=40, seed=seed),
        )
        for seed in (4, 4, 5)
    )
    for name in ("stamps_ns", "positions", "velocities", "commands"):
        assert np.array_equal(getattr(first, name), getattr(again, name))
    assert not np.array_equal(first.positions, other.positions)


def test_a_rest_sends_nothing_and_the_end_of_the_rail_sends_the_cart_back() -> None:
    plan = make_standard_plan()
    last_centred = int(np.flatnonzero(plan.centring == 0)[-1])
    assert compute_command(plan, last_centred, 0.1, 0.5, 1) == 0.0
    assert (
        compute_command(plan, last_centred, 0.6, 0.0, 1)
        < 0
        < compute_command(plan, last_centred, 0.6, 0.0, -1)
    )


def test_a_cart_whose_way_is_unknown_is_not_centred() -> None:
    plan = make_standard_plan()
    assert (
        find_command_direction(0.001) == 0
        and find_command_direction(0.05) == 1
        and find_command_direction(-0.05) == -1
    )
    assert compute_command(plan, 2000, 0.8, 0.0, 0) == plan.commands[2000]


def test_another_limit_is_kept() -> None:
    assert np.max(np.abs(make_standard_plan(Envelope(limit=0.2)).commands)) <= 0.2


def test_a_plan_too_short_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected at least 40 s"):
        make_standard_plan(seconds=5.0)

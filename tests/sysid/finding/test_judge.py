"""The judge: what is better on the choosing windows is believed, what is as good is not, one window decides nothing."""

from collections.abc import Mapping

import numpy as np
import pytest

from pendulum_sysid.finding import judge
from pendulum_sysid.finding.judge import distance, lead, needed, simplest
from pendulum_sysid.records import Estimate, Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

SAMPLES, NOISE = 101.0, np.array([1e-4, 1e-3])
POLE = Twin(
    "pole",
    Rig(pole_mass_kg=0.1, com_distance_m=0.1, pole_inertia_kg_m2=0.003, pole_viscous_n_m_s=1e-4),
)
LEVEL, STATIC = "cart_coulomb_friction.level_n", "cart_stribeck_friction.static_n"


def errors(seed: int, size: float = 3.0, windows: int = 15) -> Floats:
    """Return root mean square errors of windows, some calm and some wild, in units of noise."""
    return size * np.random.default_rng(seed).lognormal(0.0, 0.5, (windows, 2))


def fitted(
    off: Floats, effects: tuple[str, ...] = (), estimates: Mapping[str, Estimate] | None = None
) -> Fit:
    squares = SAMPLES * (off * NOISE) ** 2
    choose = float(np.exp(0.5 * np.mean(np.log(squares.mean(axis=0) / SAMPLES / NOISE**2))))
    empty = np.empty(0)
    return Fit(
        POLE,
        effects,
        dict(estimates or {}),
        empty,
        empty,
        empty,
        choose,
        choose,
        squares,
        np.full(off.shape, SAMPLES),
        NOISE,
    )


def at(value: float, half: float, identifiable: bool = True) -> Estimate:
    return Estimate(value, value - half, value + half, identifiable)


@pytest.mark.parametrize("seed", range(5))
def test_a_better_fit_leads(seed: int) -> None:
    off = errors(seed)
    found = lead(fitted(off), fitted(1.2 * off))
    assert found.real and 1.05 < found.ratio < 1.2
    assert not lead(fitted(1.2 * off), fitted(off)).real


def test_an_equal_fit_does_not_lead() -> None:
    off = errors(1)
    assert lead(fitted(off), fitted(off)).ratio == 1.0 and not lead(fitted(off), fitted(off)).real


def test_chance_seldom_leads() -> None:
    """Two fits that are equally good, each with luck in other windows."""
    random = np.random.default_rng(1)
    wins = []
    for seed in range(200):
        off = errors(seed)
        luck = random.lognormal(0.0, 0.1, (2, *off.shape))
        wins.append(lead(fitted(off * luck[0]), fitted(off * luck[1])).real)
    assert np.mean(wins) < 0.08


def test_a_lead_too_small_to_matter_is_none() -> None:
    off = errors(1)
    found = lead(fitted(off), fitted(1.003 * off))
    assert found.errors > judge.SURE and not found.real


@pytest.mark.parametrize("ahead", [1.0, 1.02])
def test_one_wild_window_does_not_decide(ahead: float) -> None:
    """The rich fit is as good or worse everywhere but where the simple one is lost."""
    off = errors(2)
    lost = off.copy()
    lost[7] *= 1e4
    rich, simple = fitted(ahead * off), fitted(lost)
    assert simple.choose > 100 * rich.choose
    assert not lead(rich, simple).real


def test_parts_of_one_window_count_once() -> None:
    """Four parts are one witness: cutting windows finer makes no lead surer."""
    off = errors(3)
    whole = lead(fitted(off), fitted(1.1 * off))
    quarters = [fitted(np.repeat(one, 4, axis=0)) for one in (off, 1.1 * off)]
    parts = lead(*(Fit(**{**vars(one), "parts": 4}) for one in quarters))
    assert (parts.ratio, parts.errors) == pytest.approx((whole.ratio, whole.errors))


def test_an_effect_is_needed_when_it_is_ahead_and_its_interval_leaves_out_nothing() -> None:
    off, coulomb = errors(4), ("cart_coulomb_friction",)
    simple = fitted(1.2 * off)
    assert needed(fitted(off, coulomb, {LEVEL: at(0.5, 0.1)}), simple, coulomb[0])
    assert not needed(fitted(off, coulomb, {LEVEL: at(0.5, 0.6)}), simple, coulomb[0])
    assert not needed(
        fitted(off, coulomb, {LEVEL: at(0.5, 0.1, identifiable=False)}), simple, coulomb[0]
    )
    assert not needed(fitted(1.2 * off, coulomb, {LEVEL: at(0.5, 0.1)}), simple, coulomb[0])


def test_an_expected_effect_need_only_be_ahead() -> None:
    off, coulomb = errors(5), ("cart_coulomb_friction",)
    rich, simple = fitted(off, coulomb, {LEVEL: at(0.5, 0.1)}), fitted(1.003 * off)
    assert not needed(rich, simple, coulomb[0]) and needed(rich, simple, coulomb[0], expected=True)
    assert not needed(rich, fitted(0.999 * off), coulomb[0], expected=True)


def test_distance_is_in_half_widths() -> None:
    one = fitted(errors(6), ("cart_coulomb_friction",), {LEVEL: at(0.5, 0.1)})
    assert distance(one, "cart_coulomb_friction") == pytest.approx(5.0)
    assert distance(fitted(errors(6), ("cart_sign_inverted",)), "cart_sign_inverted") == np.inf


def test_sizes_that_a_simpler_effect_has_do_not_speak_for_the_richer_one() -> None:
    held = {
        "cart_stribeck_friction.level_n": at(0.5, 0.01),
        STATIC: at(0.02, 0.1),
        "cart_stribeck_friction.velocity_m_s": at(0.1, 0.01),
    }
    one = fitted(errors(7), ("cart_stribeck_friction",), held)
    assert distance(one, "cart_stribeck_friction") == pytest.approx(50.0)
    assert distance(one, "cart_stribeck_friction", ("cart_coulomb_friction",)) == pytest.approx(
        0.2
    )


def test_shapes_do_not_speak_for_an_effect() -> None:
    """A clear period of a force whose size is not clear is nothing."""
    held = {"amplitude_n": at(0.1, 0.2), "period_m": at(0.1, 1e-4), "phase_rad": at(0.5, 0.1)}
    one = fitted(
        errors(8), ("cogging",), {f"cogging.{name}": value for name, value in held.items()}
    )
    assert distance(one, "cogging") == pytest.approx(0.5)


def test_the_simplest_of_those_that_are_as_good_is_taken() -> None:
    off = errors(9)
    coulomb, stribeck, cogging = (
        fitted(factor * off, (name,))
        for factor, name in (
            (1.002, "cart_coulomb_friction"),
            (1.0, "cart_stribeck_friction"),
            (1.3, "cogging"),
        )
    )
    tilt = fitted(1.2 * off, ("rail_tilt",))
    assert simplest([stribeck, coulomb, cogging, tilt]) is coulomb
    assert simplest([tilt, cogging, stribeck]) is stribeck
    assert simplest([tilt]) is tilt


def test_size_counts_parameters() -> None:
    sizes = {effect.name: judge.size(fitted(errors(0), (effect.name,))) for effect in CATALOGUE}
    assert (
        sizes["cart_sign_inverted"] == 1
        and sizes["cart_stribeck_friction"] == 3
        and min(sizes.values()) == 1
    )

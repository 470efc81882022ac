"""The judge believes a fit that is better on the choosing windows, and no single window."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_fits import make_errors, make_fit

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import (
    choose_simplest,
    compute_distance,
    compute_lead,
    count_parameters,
    is_most_explained,
    is_needed,
    is_outdone,
)
from pendulum_sysid.records import Estimate, Fit
from pendulum_twin.effects import CATALOGUE

LEVEL, STATIC = "cart_coulomb_friction.level_n", "cart_stribeck_friction.static_n"


def make_estimate(value: float, half: float, identifiable: bool = True) -> Estimate:
    return Estimate(value, value - half, value + half, identifiable)


@pytest.mark.parametrize("seed", range(5))
def test_a_better_fit_leads(seed: int) -> None:
    off = make_errors(seed)
    lead = compute_lead(make_fit(off), make_fit(1.4 * off))
    assert lead.is_real and 1.12 < lead.ratio < 1.4
    assert not compute_lead(make_fit(1.2 * off), make_fit(off)).is_real


def test_a_sure_gain_that_is_small_beside_what_is_left_is_no_lead() -> None:
    off = make_errors(2)
    small = compute_lead(make_fit(off), make_fit(1.1 * off))
    assert small.standard_errors > 5.0 and not small.is_real
    at_noise = make_errors(2, size=0.6)
    assert compute_lead(make_fit(at_noise), make_fit(1.1 * at_noise)).is_real


def test_a_rival_that_leaves_little_more_than_the_best_fit_is_not_outdone() -> None:
    """Something without a name is left; the rival may be right beside something else of it."""
    off = make_errors(2)
    best, near, far = make_fit(off), make_fit(1.4 * off), make_fit(2.5 * off)
    assert compute_lead(best, near).is_real and not is_outdone(near, best)
    assert is_outdone(far, best)
    bad_in_one_channel = make_fit(off * [1.0, 2.5])
    assert is_outdone(bad_in_one_channel, best)


def test_beside_a_perfect_fit_every_sure_lead_outdoes_a_rival() -> None:
    at_noise = make_errors(2, size=0.6)
    assert is_outdone(make_fit(1.4 * at_noise), make_fit(at_noise))
    assert not is_outdone(make_fit(at_noise), make_fit(at_noise))


def test_a_channel_without_errors_outdoes_no_rival() -> None:
    """A best fit that leaves nothing there is not ahead of a rival that leaves nothing there."""
    off = make_errors(2) * [1.0, 0.2]
    best, near, far = make_fit(off), make_fit(1.4 * off), make_fit(off * [1.0, 10.0])
    assert compute_lead(best, near).is_real and not is_outdone(near, best)
    assert is_outdone(far, best)


def test_a_fit_explains_most_if_a_simpler_fit_leaves_twice_as_much_beyond_the_noise() -> None:
    off, at_noise = make_errors(2), make_errors(2, size=0.6)
    assert is_most_explained(make_fit(off), make_fit(2.5 * off))
    assert not is_most_explained(make_fit(off), make_fit(1.4 * off))
    assert not is_most_explained(make_fit(2.5 * off), make_fit(off))
    assert is_most_explained(make_fit(at_noise), make_fit(off))
    little_of_all = make_fit(off * [0.2, 5.0]), make_fit(off * [0.6, 5.0])
    assert compute_lead(*little_of_all).is_real and not is_most_explained(*little_of_all)
    assert not is_most_explained(make_fit(at_noise), make_fit(1.4 * at_noise))


def test_an_equal_fit_does_not_lead() -> None:
    off = make_errors(1)
    assert (
        compute_lead(make_fit(off), make_fit(off)).ratio == 1.0
        and not compute_lead(make_fit(off), make_fit(off)).is_real
    )


def test_chance_seldom_leads() -> None:
    """Two fits that are equally good, each with luck in other windows."""
    random = np.random.default_rng(1)
    wins = []
    for seed in range(200):
        off = make_errors(seed)
        luck = random.lognormal(0.0, 0.1, (2, *off.shape))
        wins.append(compute_lead(make_fit(off * luck[0]), make_fit(off * luck[1])).is_real)
    assert np.mean(wins) < 0.08


def test_a_lead_too_small_to_matter_is_none() -> None:
    off = make_errors(1)
    lead = compute_lead(make_fit(off), make_fit(1.003 * off))
    assert lead.standard_errors > decisions.LEAD_STANDARD_ERRORS and not lead.is_real


@pytest.mark.parametrize("ahead", [1.0, 1.02])
def test_one_wild_window_does_not_decide(ahead: float) -> None:
    """The rich fit is as good or worse everywhere but where the simple one is lost."""
    off = make_errors(2)
    lost = off.copy()
    lost[7] *= 1e4
    rich, simple = make_fit(ahead * off), make_fit(lost)
    assert simple.choose > 100 * rich.choose
    assert not compute_lead(rich, simple).is_real


def test_pieces_of_a_window_count_once() -> None:
    """Four pieces are one witness: cutting windows finer makes no lead surer."""
    off = make_errors(3)
    whole = compute_lead(make_fit(off), make_fit(1.1 * off))
    quarters = [make_fit(np.repeat(windows, 4, axis=0)) for windows in (off, 1.1 * off)]
    by_pieces = compute_lead(*(Fit(**{**vars(fit), "pieces": 4}) for fit in quarters))
    assert (by_pieces.ratio, by_pieces.standard_errors) == pytest.approx(
        (whole.ratio, whole.standard_errors)
    )


@pytest.mark.parametrize(("windows", "likely"), [(1, False), (2, True)])
def test_a_lead_of_a_single_window_is_not_likely(windows: int, likely: bool) -> None:
    """The window that gains most is left out: a hand may have struck the rig there."""
    at_noise = np.ones((60, 2))
    off = at_noise.copy()
    off[: 4 * windows] = 3.0
    rich, simple = (replace(make_fit(errors), pieces=4) for errors in (at_noise, off))
    assert compute_lead(rich, simple).likely is likely


def test_an_effect_is_needed_when_it_is_ahead_and_its_interval_leaves_out_nothing() -> None:
    off, coulomb = make_errors(4), ("cart_coulomb_friction",)
    simple = make_fit(1.5 * off)
    assert is_needed(make_fit(off, coulomb, {LEVEL: make_estimate(0.5, 0.1)}), simple, coulomb[0])
    assert not is_needed(
        make_fit(off, coulomb, {LEVEL: make_estimate(0.5, 0.6)}), simple, coulomb[0]
    )
    assert not is_needed(
        make_fit(off, coulomb, {LEVEL: make_estimate(0.5, 0.1, identifiable=False)}),
        simple,
        coulomb[0],
    )
    assert not is_needed(
        make_fit(1.5 * off, coulomb, {LEVEL: make_estimate(0.5, 0.1)}), simple, coulomb[0]
    )


def test_an_expected_effect_need_only_be_ahead() -> None:
    off, coulomb = make_errors(5), ("cart_coulomb_friction",)
    rich, simple = make_fit(off, coulomb, {LEVEL: make_estimate(0.5, 0.1)}), make_fit(1.003 * off)
    assert not is_needed(rich, simple, coulomb[0]) and is_needed(
        rich, simple, coulomb[0], expected=True
    )
    assert not is_needed(rich, make_fit(0.999 * off), coulomb[0], expected=True)


def test_distance_is_in_half_widths() -> None:
    fit = make_fit(make_errors(6), ("cart_coulomb_friction",), {LEVEL: make_estimate(0.5, 0.1)})
    assert compute_distance(fit, "cart_coulomb_friction") == pytest.approx(5.0)
    assert (
        compute_distance(make_fit(make_errors(6), ("cart_sign_inverted",)), "cart_sign_inverted")
        == np.inf
    )


@pytest.mark.parametrize(("low", "high"), [(0.4, 0.51), (0.49, 0.6)])
def test_distance_is_in_the_wider_half_of_an_interval(low: float, high: float) -> None:
    estimates = {LEVEL: Estimate(0.5, low, high, True)}
    fit = make_fit(make_errors(6), ("cart_coulomb_friction",), estimates)
    assert compute_distance(fit, "cart_coulomb_friction") == pytest.approx(5.0)


def test_sizes_that_a_simpler_effect_has_do_not_speak_for_the_richer_one() -> None:
    estimates = {
        "cart_stribeck_friction.level_n": make_estimate(0.5, 0.01),
        STATIC: make_estimate(0.02, 0.1),
        "cart_stribeck_friction.velocity_m_s": make_estimate(0.1, 0.01),
    }
    fit = make_fit(make_errors(7), ("cart_stribeck_friction",), estimates)
    assert compute_distance(fit, "cart_stribeck_friction") == pytest.approx(50.0)
    assert compute_distance(
        fit, "cart_stribeck_friction", ("cart_coulomb_friction",)
    ) == pytest.approx(0.2)


def test_shapes_do_not_speak_for_an_effect() -> None:
    """A clear period of a force whose size is not clear is nothing."""
    estimates = {
        "amplitude_n": make_estimate(0.1, 0.2),
        "period_m": make_estimate(0.1, 1e-4),
        "phase_rad": make_estimate(0.5, 0.1),
    }
    fit = make_fit(
        make_errors(8),
        ("cogging",),
        {f"cogging.{name}": value for name, value in estimates.items()},
    )
    assert compute_distance(fit, "cogging") == pytest.approx(0.5)


def test_the_simplest_of_those_that_are_as_good_is_taken() -> None:
    off = make_errors(9, size=0.6)
    coulomb, stribeck, cogging = (
        make_fit(factor * off, (name,))
        for factor, name in (
            (1.002, "cart_coulomb_friction"),
            (1.0, "cart_stribeck_friction"),
            (1.3, "cogging"),
        )
    )
    tilt = make_fit(1.2 * off, ("rail_tilt",))
    assert choose_simplest([stribeck, coulomb, cogging, tilt]) is coulomb
    assert choose_simplest([tilt, cogging, stribeck]) is stribeck
    assert choose_simplest([tilt]) is tilt


def test_size_counts_parameters() -> None:
    sizes = {
        effect.name: count_parameters(make_fit(make_errors(0), (effect.name,)))
        for effect in CATALOGUE
    }
    assert (
        sizes["cart_sign_inverted"] == 1
        and sizes["cart_stribeck_friction"] == 3
        and min(sizes.values()) == 1
    )

"""Decide between fits by their errors on windows that were left out (cross-validation)."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.parameters import Free, Scales, list_effect_parameters
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Parameter

FINEST_HALF = 1e-9  # of the distance: an interval without a width is no error


@dataclass(frozen=True)
class Lead:
    """Hold how far a rich fit is ahead of a simple fit.

    ratio: of misfits, simple over rich.
    standard_errors: of the gain over paired windows.
    likely: True if the rich fit's errors are mere noise and those of the simple fit surely are
        not, in however few windows.
    stands_out: whether the gain is large beside what is left, in the channel that gains most: what
        a model leaves out lets any effect gain a little.
    """

    ratio: float
    standard_errors: float
    likely: bool = False
    stands_out: bool = True

    @property
    def is_real(self) -> bool:
        """Return whether the lead is more than chance, and large beside what is left."""
        return (self.is_sure and self.stands_out) or self.likely

    @property
    def is_sure(self) -> bool:
        """Return whether the lead is more than chance, however much is left."""
        by_windows = self.standard_errors >= decisions.LEAD_STANDARD_ERRORS
        return by_windows and self.ratio >= decisions.LEAD_MISFIT_RATIO


def compute_lead(rich: Fit, simple: Fit) -> Lead:
    """Return how far the rich fit is ahead on windows left out.

    Windows are compared pair by pair under a heavy-tailed likelihood whose scale is the rich fit's
    typical window (Lange, Little and Taylor, J. Am. Stat. Assoc. 84 (1989) 881): neither one wild
    window nor many quiet windows decide alone.
    """
    by_channel = compute_log_errors(simple, rich) - compute_log_errors(rich, rich)
    gains = by_channel.mean(axis=1)
    blocks = average_over_blocks(gains)
    spread = float(np.std(blocks, ddof=1)) / np.sqrt(len(blocks)) if len(blocks) > 1 else np.inf
    ahead = float(np.mean(gains)) / max(spread, 1e-12)
    likely = decisions.ACCEPT_LIKELIHOOD and _is_likely(rich, simple)
    least = np.log([_compute_least_ratio(misfit) for misfit in _compute_misfits(rich)])
    stands_out = bool(np.any(by_channel.mean(axis=0) >= least))
    return Lead(float(np.exp(np.mean(gains))), ahead, likely, stands_out)


def _compute_misfits(fit: Fit) -> Floats:
    """Return the misfit of each channel, (channels,), in units of its noise."""
    power = fit.window_squares.sum(axis=0) / np.maximum(fit.counts.sum(axis=0), 1.0)
    return np.sqrt(power) / fit.noise


def _compute_least_ratio(misfit: float) -> float:
    """Return the ratio of misfits by which a richer twin has to be ahead, however sure the lead.

    misfit: of the richer twin, in units of noise.

    A richer twin takes away a share of what is left beyond the noise by chance alone: whatever is
    left out is the same in every window, so no number of windows tells chance from cause. The
    heavy-tailed likelihood of a lead counts half of a typical window's gain of power.
    """
    rest = max(1.0 - 1.0 / max(misfit**2, 1e-300), 0.0)
    gain = 0.5 * decisions.LEAD_SHARE_OF_REST * rest
    return max(decisions.LEAD_MISFIT_RATIO, float(np.sqrt(1.0 + gain)))


def _is_likely(rich: Fit, simple: Fit) -> bool:
    """Return whether the rich fit leaves noise alone and the simple fit more.

    The likelihood is that of Gaussian errors with the rich fit's own variance, the best window
    left out. It is asked over short horizons only: over a long horizon, an error of the start near
    upright grows until it is all that counts.
    """
    if (
        rich.pieces == 1
        or rich.pieces != simple.pieces
        or rich.choose > decisions.MISFIT_AT_NOISE
        or simple.choose < decisions.LIKELIHOOD_MISFIT_RATIO * rich.choose
    ):
        return False
    variance = rich.window_squares.sum(axis=0) / np.maximum(rich.counts.sum(axis=0), 1.0)
    gains = np.sum((simple.window_squares - rich.window_squares) / (2.0 * variance), axis=1)
    gains = np.sort(gains.reshape(-1, rich.pieces).sum(axis=1))
    return float(gains[:-1].sum()) > decisions.LIKELIHOOD_GAIN_NATS


def compute_log_errors(fit: Fit, of: Fit) -> Floats:
    """Return the logarithm of each window's error, (windows, channels), heavy tails allowed for.

    of: the fit whose typical window is the scale.
    """
    return 0.5 * np.log1p(_compute_powers(fit) / np.median(_compute_powers(of), axis=0))


def is_outdone(rival: Fit, best: Fit) -> bool:
    """Return whether a fit is surely worse than the best fit, which holds another effect instead.

    A best fit above the noise leaves forces without a name. They are the same in every window, so
    no number of windows tells whether the rival is wrong, or right beside other such forces. The
    rival is wrong where it leaves RIVAL_REST_RATIO times as much in a channel, by amplitude: with
    sizes of forces of all orders equally likely, and four free numbers of a force, odds of 16.
    """
    if not compute_lead(best, rival).is_real:
        return False
    return best.choose <= decisions.MISFIT_AT_NOISE or bool(np.any(_has_larger_rest(rival, best)))


def is_most_explained(rich: Fit, simple: Fit) -> bool:
    """Return whether a fit is surely ahead, and leaves little of what a simpler fit leaves.

    The channel in which the simpler fit leaves most decides (`_has_larger_rest`).
    """
    most = int(np.argmax(_compute_misfits(simple)))
    return compute_lead(rich, simple).is_real and bool(_has_larger_rest(simple, rich)[most])


def _has_larger_rest(fit: Fit, other: Fit) -> Mask:
    """Return in which channels, (channels,), a fit leaves RIVAL_REST_RATIO times as much.

    By the amplitude beyond the noise. No fit counts as leaving less than a fit that is just at the
    noise.
    """
    left, left_by_other = (_compute_misfits(f) ** 2 - 1.0 for f in (fit, other))
    least = np.maximum(left_by_other, decisions.MISFIT_AT_NOISE**2 - 1.0)
    return np.asarray(left >= decisions.RIVAL_REST_RATIO**2 * least)


def judge_over_whole_windows(case: Case, split: Split, fit: Fit) -> Fit:
    """Return a fit with its errors taken over whole windows, nothing refitted."""
    whole = refine_start_states(case.problem(split.learn), fit.theta)
    return replace(fit, window_squares=whole.squares, counts=whole.counts, pieces=1)


def average_over_blocks(values: Floats) -> Floats:
    """Return the means of values (windows,) over blocks of time, (blocks,).

    Errors of windows nearby are alike; those of blocks count as independent.
    """
    parts = np.array_split(values, min(len(values), decisions.LEAD_BLOCKS))
    return np.array([part.mean() for part in parts])


def _compute_powers(fit: Fit) -> Floats:
    """Return each window's mean squared error, (windows, channels).

    Parts of one window are averaged.
    """
    power = fit.window_squares / np.maximum(fit.counts, 1.0)
    whole = power.reshape(-1, fit.pieces, power.shape[1]).mean(axis=1)
    return np.maximum(whole, (0.1 * fit.noise) ** 2)


def count_parameters(fit: Fit) -> int:
    """Return how many parameters the effects of a fit have."""
    return sum(max(len(BY_NAME[name].parameters), 1) for name in fit.effects)


def is_needed(rich: Fit, simple: Fit, effect: str, expected: bool = False) -> bool:
    """Return whether a rich fit needs the effect that the simple fit lacks.

    Its interval from the learning windows must leave out the value at which the effect vanishes,
    and the rich fit must be really ahead on windows left out.

    expected: other evidence names the effect; the rich fit need only be ahead.
    """
    lead = compute_lead(rich, simple)
    ahead = lead.is_real or (expected and lead.ratio > 1.0)
    return ahead and compute_distance(rich, effect, simple.effects) > 1.0


def compute_distance(fit: Fit, effect: str, others: Collection[str] = ()) -> float:
    """Return how many half widths of its interval an effect's clearest size lies from nothing.

    others: effects of the fit that this fit is compared with. A size that a simpler effect among
        them has as well does not count: the effect does not add that size.
    """
    simpler = [BY_NAME[name] for name in others if name in BY_NAME[effect].simpler]
    known = {parameter.name for law in simpler for parameter in law.parameters}
    sizes = [p for p in BY_NAME[effect].sizes if p.name not in known]
    distances = [] if sizes else [np.inf]
    if any(
        p.shape and _is_at_bound(fit, f"{effect}.{p.name}") for p in BY_NAME[effect].parameters
    ):
        return 0.0  # the place, period or limit lies where nothing was visited
    for p in sizes:
        estimate = fit.estimates[f"{effect}.{p.name}"]
        half = max(estimate.high - estimate.value, estimate.value - estimate.low, 1e-300)
        size = abs(estimate.value - p.neutral)
        distances.append(size / half if estimate.identifiable and size >= p.least else 0.0)
    return max(distances)


def is_surely_there(fit: Fit, effect: str, scales: Scales) -> bool:
    """Return whether the interval of a size leaves out the values at which the effect is nothing.

    The size of an effect of shapes alone is a shape: the step of a coarse command. A limit does
    nothing from the largest command on. True for an effect without a size that is estimated. An
    effect is not surely there where a shape that confines it may reach its bound: a patch as wide
    as the visited rail is a drag along the rail, and a friction that levels off nowhere is a
    viscous friction. Neither is a wave that may have any phase. The errors of several sizes are
    taken to be independent.

    scales: of the recording.
    """
    free = {f.name: f for f in list_effect_parameters(BY_NAME[effect], scales)}
    if any(_may_be_anything(parameter, fit) for parameter in free.values()):
        return False
    parameters = [p for p in BY_NAME[effect].parameters if np.isfinite(p.neutral)]
    sizes = [p for p in parameters if not p.shape] or parameters
    distances = [
        _measure_distance(p, free[name], fit.estimates[name], scales)
        for p in sizes
        if (name := f"{effect}.{p.name}") in fit.estimates
    ]
    if not distances:
        return True
    # Of several sizes one leaves 0 out by chance more often: the 95 % region of all counts.
    squares = np.square(distances)
    return bool(np.sum(squares) > chdtri(len(squares), 0.05) / chdtri(1, 0.05))


def _may_be_anything(parameter: Free, fit: Fit) -> bool:
    """Return whether the interval of a shape leaves open what the effect is.

    It reaches the largest value of a shape that confines, or holds every phase of a wave.
    """
    estimate = fit.estimates.get(parameter.name)
    effect, _, name = parameter.name.partition(".")
    (declared,) = (p for p in BY_NAME[effect].parameters if p.name == name)
    if estimate is None:
        return False
    if declared.phase:
        return estimate.high - estimate.low >= 2.0 * np.pi
    return declared.confines and estimate.high >= parameter.high


def _measure_distance(
    parameter: Parameter, free: Free, estimate: Estimate, scales: Scales
) -> float:
    """Return how far a size is from the values at which it does nothing, 0 or more.

    In half widths of its interval to that side; more than 1 leaves these values out. An interval
    that reaches the bound of the fit holds all values beyond: a limit of a bending drive does
    nothing only far above all commands, where no fit goes.
    """
    below, above = estimate.value - estimate.low, estimate.high - estimate.value
    if parameter.idle_beyond is not None:
        away, half = max(scales[parameter.idle_beyond] - estimate.value, 0.0), above
    else:
        nothing = min(max(parameter.neutral, free.low), free.high)
        away = abs(estimate.value - nothing)
        half = below if estimate.value > nothing else above
    return away / max(half, FINEST_HALF * away, 1e-300)


def _is_at_bound(fit: Fit, name: str) -> bool:
    return name in fit.estimates and fit.estimates[name].at_bound


def choose_simplest(fits: Sequence[Fit]) -> Fit:
    """Return the fit with the fewest parameters that the best fit is not really ahead of."""
    best = min(fits, key=lambda fit: fit.choose)
    near = [fit for fit in fits if fit is best or not compute_lead(best, fit).is_real]
    return min(near, key=lambda fit: (count_parameters(fit), fit.choose))

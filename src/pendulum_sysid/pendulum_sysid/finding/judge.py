"""Decide between fits on the choosing windows, which none of them was fitted on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.finding.separation import SURE, WORTH
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME

AT_NOISE = 1.2  # misfit up to which errors are the sensors' noise, and a likelihood can be trusted
NATS = 20.0  # of it that a richer twin must gain, its best window left out: noise of encoders is not white
PLAIN = 1.01  # ... and at least this factor of misfit


@dataclass(frozen=True)
class Lead:
    """Say how far a rich fit is ahead of a simple one: ratio of misfits, and standard errors over paired windows.

    likely: whether its errors are mere noise and those of the simple one surely are not, in
    however few windows.
    """

    ratio: float
    errors: float
    likely: bool = False

    @property
    def real(self) -> bool:
        """Return whether the lead is more than chance."""
        return (self.ratio >= WORTH and self.errors >= SURE) or self.likely


def lead(rich: Fit, simple: Fit) -> Lead:
    """Return how far the rich fit is ahead on the choosing windows.

    Windows are compared pair by pair under a heavy-tailed likelihood whose scale is the rich fit's
    typical window (Lange, Little and Taylor, J. Am. Stat. Assoc. 84 (1989) 881): neither one wild
    window nor many quiet ones decide alone.
    """
    scale = np.median(_powers(rich), axis=0)
    gains = (_log_errors(simple, scale) - _log_errors(rich, scale)).mean(axis=1)
    spread = float(np.std(gains, ddof=1)) / np.sqrt(len(gains)) if len(gains) > 1 else np.inf
    ahead = float(np.mean(gains)) / max(spread, 1e-12)
    return Lead(float(np.exp(np.mean(gains))), ahead, _likely(rich, simple))


def _likely(rich: Fit, simple: Fit) -> bool:
    """Return whether the rich fit leaves noise alone and the simple one more: an effect may show in a few windows only.

    The likelihood is that of Gaussian errors with the rich fit's own variance. It is asked over
    short horizons only: over a long one, an error of the start near upright grows until it is all
    that counts.
    """
    if (
        rich.parts == 1
        or rich.parts != simple.parts
        or rich.choose > AT_NOISE
        or simple.choose < PLAIN * rich.choose
    ):
        return False
    variance = rich.window_squares.sum(axis=0) / np.maximum(rich.counts.sum(axis=0), 1.0)
    gains = np.sum((simple.window_squares - rich.window_squares) / (2.0 * variance), axis=1)
    gains = np.sort(gains.reshape(-1, rich.parts).sum(axis=1))
    return float(gains[:-1].sum()) > NATS


def _log_errors(fit: Fit, scale: Floats) -> Floats:
    return 0.5 * np.log1p(_powers(fit) / scale)


def _powers(fit: Fit) -> Floats:
    """Return each choosing window's mean squared error, (windows, channels); parts of one window are averaged."""
    power = fit.window_squares / np.maximum(fit.counts, 1.0)
    return np.maximum(
        power.reshape(-1, fit.parts, power.shape[1]).mean(axis=1), (0.1 * fit.noise) ** 2
    )


def size(fit: Fit) -> int:
    """Return how many parameters the effects of a fit have."""
    return sum(max(len(BY_NAME[name].parameters), 1) for name in fit.effects)


def needed(rich: Fit, simple: Fit, effect: str, expected: bool = False) -> bool:
    """Return whether a rich fit needs the effect that it has more than a simple one.

    Its interval from the training windows must leave out the value at which the effect vanishes,
    and it must be really ahead on the choosing windows; an effect that is expected, for other
    evidence named it, need only be ahead there.
    """
    found = lead(rich, simple)
    return distance(rich, effect, simple.effects) > 1.0 and (
        found.real or (expected and found.ratio > 1.0)
    )


def distance(fit: Fit, effect: str, held: tuple[str, ...] = ()) -> float:
    """Return how many half widths of its interval an effect's clearest size lies from where it vanishes.

    Sizes that a simpler effect among those held has as well do not count: they are not what the
    effect adds.
    """
    known = {
        p.name
        for name in held
        if name in BY_NAME[effect].simpler
        for p in BY_NAME[name].parameters
    }
    sizes = [p for p in BY_NAME[effect].parameters if not p.shape and p.name not in known]
    far = [] if sizes else [np.inf]
    for p in sizes:
        one = fit.estimates[f"{effect}.{p.name}"]
        half = max(one.high - one.value, one.value - one.low, 1e-300)
        off = abs(one.value - p.neutral)
        least = max(p.least, p.rounding * float(fit.noise[-1]))
        far.append(off / half if one.identifiable and off >= least else 0.0)
    return max(far)


def simplest(fits: list[Fit]) -> Fit:
    """Return the fit with the fewest parameters that the best one is not really ahead of."""
    best = min(fits, key=lambda one: one.choose)
    near = [one for one in fits if one is best or not lead(best, one).real]
    return min(near, key=lambda one: (size(one), one.choose))

"""Find the instant at which a load is put on the cart, or taken off it.

A run knows nothing of an instant that is far off. The balance of the force judges every instant at
once: from there on each kg of the load adds minus the acceleration to the force.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import take_out
from pendulum_sysid.finding.localisation.balance import Balance
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import load_put_on
from pendulum_twin.sensors import compute_paces

EFFECT = load_put_on.EFFECT
INSTANTS = 60  # tried at once: a second apart in a minute


def read_load(sight: Sight) -> tuple[Reading, ...]:
    """Return the load that explains most of the cart's missing force; none without a cart."""
    balance = sight.force
    if balance is None:
        return ()
    acceleration = sight.motion.a
    t = sight.thinned.signals.clock_s * float(compute_paces(sight.theta))
    spaced = np.linspace(float(np.min(t)), float(np.max(t)), INSTANTS + 2)[1:-1]
    _, about_s = _find_load(balance, acceleration, t, spaced)
    near = about_s + (spaced[1] - spaced[0]) * np.linspace(-1.0, 1.0, INSTANTS)
    load_kg, time_s = _find_load(balance, acceleration, t, near)
    return (Reading(EFFECT.name, (load_kg, max(time_s, 0.0))),)


def _find_load(
    balance: Balance, acceleration: Floats, t: Floats, instants: Floats
) -> tuple[float, float]:
    """Return the load, kg, and the instant, s, that explain most of what a balance lacks.

    acceleration: (n,) of the cart, m/s^2; t: (n,) s.
    instants: (k,) s, rising.

    What is missing after an instant is the sum of what is missing in the pieces after it, so that
    each piece goes through the sieve once.
    """
    piece = np.searchsorted(instants, t, side="right")
    columns = -acceleration[:, None] * (piece[:, None] == np.arange(1, len(instants) + 1))
    own = np.linalg.qr(balance.turned)[0]
    pieces = take_out(own, balance.sieve(columns))
    after = np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1]
    likeness, size = balance.lacking @ after, np.sum(after**2, axis=0)
    loads = likeness / np.maximum(size, 1e-12 * float(np.max(size, initial=1e-300)))
    best = int(np.argmax(loads * likeness))
    load = EFFECT.parameters[0]
    return float(np.clip(loads[best], load.low, load.high)), float(instants[best])


DETECTOR = Detector(EFFECT, Use.START, read_load)

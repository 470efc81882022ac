"""A realistic rest: several small pieces of physics that the catalogue does not hold, always on.

A real rig never runs as its best model: on the INTECO rig 10 to 15 noise floors remain over a
second. The rest of an emulated rig is of that size, of everyday causes, and nobody asks for its
names.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pendulum_bridge.emulator.conceal import draw_sizes
from pendulum_bridge.emulator.unlisted.table import BY_NAME

COUNT = 5  # pieces of a rest
# Times the sizes of `unlisted`: together they leave a median of 12 noise floors to the true model;
# measured on 8 rigs (4 to 23).
SHARE = 0.1
# What every rig has a little of: its encoders and racks are not quite round, its supply gives
# way, cables and guides drag, grease warms up.
EVERYDAY = (
    "wobbling_disc",
    "bent_rack",
    "outward_brake",
    "gain_along_rail",
    "gain_falling_with_speed",
    "supply_ripple",
    "fanned_cart",
    "leaning_guide",
    "dragged_cable",
    "hanging_cable",
    "recovering_battery",
    "bearing_notch",
    "oily_bearing",
)


def draw_rest(
    seed: int, besides: Collection[str] = (), size_factor: float = 1.0
) -> dict[str, dict[str, float]]:
    """Return pieces of unlisted physics with their parameters, drawn by the seed.

    besides: names that are concealed already, and are not drawn.
    size_factor: multiplies the sizes.
    """
    random = np.random.default_rng([seed, 2])
    names = [name for name in random.permutation(EVERYDAY).tolist() if name not in besides]
    return {name: draw_sizes(BY_NAME[name], random, SHARE * size_factor) for name in names[:COUNT]}

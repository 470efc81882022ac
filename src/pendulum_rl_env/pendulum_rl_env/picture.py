"""Draw cart and pole with numpy alone: small, and the same on every machine."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.arrays import Floats

WIDTH, HEIGHT = 480, 320
POLE_PX, CART_PX, THICK_PX = 110, (50, 24), 5.0
RAIL_SHARE = 0.45  # of the width, that half the rail takes
PAPER, RAIL, CART, POLE = (255, 255, 255), (150, 150, 150), (40, 60, 110), (200, 70, 40)


def draw_picture(state: Floats, half_rail_m: float) -> NDArray[np.uint8]:
    """Return a picture (HEIGHT, WIDTH, 3) of cart and pole.

    state: x (m) and th (rad, 0 upright, counterclockwise positive) first.
    half_rail_m: m; half of the rail that the picture shows.
    """
    picture = np.full((HEIGHT, WIDTH, 3), PAPER, dtype=np.uint8)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    scale = RAIL_SHARE * WIDTH / half_rail_m
    x = WIDTH / 2 + scale * float(np.clip(state[0], -2 * half_rail_m, 2 * half_rail_m))
    y = HEIGHT / 2
    on_rail = (np.abs(rows - y) <= 1) & (np.abs(columns - WIDTH / 2) <= scale * half_rail_m)
    picture[on_rail] = RAIL
    picture[(np.abs(columns - x) <= CART_PX[0] / 2) & (np.abs(rows - y) <= CART_PX[1] / 2)] = CART
    along, across = -np.sin(state[1]), -np.cos(state[1])  # counterclockwise: left of upright
    distance = np.clip((columns - x) * along + (rows - y) * across, 0, POLE_PX)
    near = np.hypot(columns - x - distance * along, rows - y - distance * across) <= THICK_PX
    picture[near] = POLE
    return picture

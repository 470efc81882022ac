"""A picture of cart and pole, drawn with numpy alone: small, and the same everywhere."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 480, 320
POLE_PX, CART_PX, THICK_PX = 110, (50, 24), 5.0
PAPER, RAIL, CART, POLE = (255, 255, 255), (150, 150, 150), (40, 60, 110), (200, 70, 40)


def draw_picture(state: NDArray[np.float64], half_rail_m: float) -> NDArray[np.uint8]:
    """Return cart and pole at x (m), th (rad, 0 upright, counterclockwise), (HEIGHT, WIDTH, 3), the rail +-half_rail_m."""
    picture = np.full((HEIGHT, WIDTH, 3), PAPER, dtype=np.uint8)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    scale = 0.45 * WIDTH / half_rail_m
    x, y = (
        WIDTH / 2 + scale * float(np.clip(state[0], -2 * half_rail_m, 2 * half_rail_m)),
        HEIGHT / 2,
    )
    on_rail = (np.abs(rows - y) <= 1) & (np.abs(columns - WIDTH / 2) <= scale * half_rail_m)
    picture[on_rail] = RAIL
    picture[(np.abs(columns - x) <= CART_PX[0] / 2) & (np.abs(rows - y) <= CART_PX[1] / 2)] = CART
    along, across = (
        -np.sin(state[1]),
        -np.cos(state[1]),
    )  # counterclockwise: to the left of upright
    distance = np.clip((columns - x) * along + (rows - y) * across, 0, POLE_PX)
    near = np.hypot(columns - x - distance * along, rows - y - distance * across) <= THICK_PX
    picture[near] = POLE
    return picture

"""Draw cart and pole over a scale in metres, with the time: the same on every machine."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from pendulum_twin.arrays import Floats

WIDTH, HEIGHT = 480, 320
POLE_PX, CART_PX, THICK_PX = 110, (50, 24), 5.0
RAIL_SHARE = 0.45  # of the width, that half the rail takes
PAPER, RAIL, CART, POLE = (255, 255, 255), (150, 150, 150), (40, 60, 110), (200, 70, 40)
INK = (90, 90, 90)
TICK_M, LABEL_TICKS = 0.1, 2  # from tick to tick, and from label to label in ticks
SCALE_PX, TICK_PX, TEXT_PX = 290, 6, 11  # height of the scale, length of a tick, size of letters
TIME_PX = (8, 6)


def draw_picture(state: Floats, half_rail_m: float, t_s: float | None = None) -> NDArray[np.uint8]:
    """Return a picture (HEIGHT, WIDTH, 3) of cart and pole over a scale.

    state: x (m) and th (rad, 0 upright, counterclockwise positive) first.
    half_rail_m: m; half of the rail that the picture shows.
    t_s: s since the episode began, written into the corner; None for no time.
    """
    picture = _draw_rail(half_rail_m, t_s)
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    scale = RAIL_SHARE * WIDTH / half_rail_m
    x = WIDTH / 2 + scale * float(np.clip(state[0], -2 * half_rail_m, 2 * half_rail_m))
    y = HEIGHT / 2
    picture[(np.abs(columns - x) <= CART_PX[0] / 2) & (np.abs(rows - y) <= CART_PX[1] / 2)] = CART
    along, across = -np.sin(state[1]), -np.cos(state[1])  # counterclockwise: left of upright
    distance = np.clip((columns - x) * along + (rows - y) * across, 0, POLE_PX)
    near = np.hypot(columns - x - distance * along, rows - y - distance * across) <= THICK_PX
    picture[near] = POLE
    return picture


def _draw_rail(half_rail_m: float, t_s: float | None) -> NDArray[np.uint8]:
    """Return a new picture of rail, scale and time."""
    ground = _draw_ground(half_rail_m)
    if t_s is None:
        return ground.copy()
    image = Image.fromarray(ground)
    ImageDraw.Draw(image).text(TIME_PX, f"{t_s:6.2f} s", INK, _load_font())
    return np.array(image)


@lru_cache(maxsize=4)
def _draw_ground(half_rail_m: float) -> NDArray[np.uint8]:
    """Return the picture of the rail and a scale below it; callers copy it."""
    image = Image.new("RGB", (WIDTH, HEIGHT), PAPER)
    draw, font = ImageDraw.Draw(image), _load_font()
    scale, middle = RAIL_SHARE * WIDTH / half_rail_m, WIDTH / 2
    ends = middle - scale * half_rail_m, middle + scale * half_rail_m
    draw.rectangle((ends[0], HEIGHT / 2 - 1, ends[1], HEIGHT / 2 + 1), fill=RAIL)
    draw.line((ends[0], SCALE_PX, ends[1], SCALE_PX), fill=INK)
    most = int(half_rail_m / TICK_M + 1e-9)
    for k in range(-most, most + 1):
        column = middle + scale * k * TICK_M
        draw.line((column, SCALE_PX, column, SCALE_PX + TICK_PX), fill=INK)
        if k % LABEL_TICKS == 0:
            label = f"{k * TICK_M:.1f}" + (" m" if k == 0 else "")
            draw.text((column, SCALE_PX + TICK_PX + 1), label, INK, font, anchor="ma")
    return np.array(image)


@lru_cache(maxsize=1)
def _load_font() -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return the letters that Pillow brings along."""
    return ImageFont.load_default(TEXT_PX)

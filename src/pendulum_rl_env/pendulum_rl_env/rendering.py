"""Render an environment as Gymnasium's users expect: pictures, or a window."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.picture import HEIGHT, WIDTH, draw_picture
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

RENDER_MODES = ("human", "rgb_array")
TITLE = "Inverted pendulum"


class Renderer:
    """Show the states of an environment in the mode that it was made with.

    mode: "human" for a window, "rgb_array" for pictures, None for nothing.
    half_rail_m: m; half of the rail that the picture shows.
    step_s: s; a window shows states no faster than this.

    Raises BadInputError for another mode, and for a window where pygame is not installed.
    """

    def __init__(self, mode: str | None, half_rail_m: float, step_s: float) -> None:
        if mode is not None and mode not in RENDER_MODES:
            raise BadInputError(
                f"render_mode: expected {', '.join(RENDER_MODES)} or None, found {mode!r}"
            )
        self.mode, self._half_rail_m = mode, half_rail_m
        self._window = _Window(step_s) if mode == "human" else None

    def render(self, state: Floats, t_s: float) -> NDArray[np.uint8] | None:
        """Return the picture of a state, (height, width, 3), or show it in the window."""
        if self.mode is None:
            return None
        picture = draw_picture(state, self._half_rail_m, t_s)
        if self._window is None:
            return picture
        self._window.show(picture)
        return None

    def follow(self, state: Floats, t_s: float) -> None:
        """Show a state in the window, if there is a window; call it after every step and reset."""
        if self._window is not None:
            self.render(state, t_s)

    def close(self) -> None:
        """Close the window; a second call does nothing."""
        if self._window is not None:
            self._window.close()


class _Window:
    """Show pictures in a window of pygame, which opens with the first picture."""

    def __init__(self, step_s: float) -> None:
        try:
            import pygame
        except ImportError as error:
            raise BadInputError(
                'render_mode "human": expected pygame for the window, found it not installed: '
                'pip install pygame, or choose "rgb_array"'
            ) from error
        self._pygame: Any = pygame
        # Rounded up: a rig in real time is never held up.
        self._pictures_per_s = math.ceil(1 / step_s)
        self._screen: Any = None

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture, and wait until the picture before it was shown for a period."""
        if self._screen is None:
            self._open()
        self._pygame.event.pump()
        surface = self._pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        self._screen.blit(surface, (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._pictures_per_s)

    def close(self) -> None:
        """Close the window."""
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None

    def _open(self) -> None:
        try:
            self._pygame.display.init()
            self._screen = self._pygame.display.set_mode((WIDTH, HEIGHT))
        except self._pygame.error as error:
            raise BadInputError(
                f'render_mode "human": expected a display, found none ({error}): choose '
                '"rgb_array", or set SDL_VIDEODRIVER=dummy'
            ) from error
        self._pygame.display.set_caption(TITLE)
        self._clock = self._pygame.time.Clock()

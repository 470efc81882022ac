"""Write an episode as an animation (GIF)."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from pendulum_rl_env.picture import draw_picture
from pendulum_rl_env.scoring import Episode
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically

STEPS_A_PICTURE = 2  # many viewers play GIFs of more than 20 pictures a second too slowly
COLOURS = 16
SIZE_PX = (360, 240)


def save_video(episode: Episode, task: Task, path: Path) -> None:
    """Write the episode at its own pace; raise BadInputError when it cannot be written."""
    pictures = [
        Image.fromarray(draw_picture(state, task.x_limit_m)).resize(SIZE_PX).quantize(COLOURS)
        for state in episode.states[::STEPS_A_PICTURE]
    ]
    content = io.BytesIO()
    millis = round(1000 * STEPS_A_PICTURE * task.step_s)
    pictures[0].save(
        content, "GIF", save_all=True, append_images=pictures[1:], duration=millis, loop=0
    )
    try:
        write_atomically(path, content.getvalue())
    except OSError as error:
        raise BadInputError(
            f"{path}: expected a place for the animation, found {error.strerror}"
        ) from error

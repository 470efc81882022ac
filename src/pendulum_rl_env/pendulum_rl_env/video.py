"""An episode as an animation (GIF)."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

from pendulum_rl_env.picture import draw_picture
from pendulum_rl_env.scoring import Episode
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError

STEPS_A_PICTURE = (
    2  # steps a picture: GIFs of more than 20 pictures a second play slowly in many viewers
)
COLOURS = 16


def save_video(episode: Episode, task: Task, path: Path) -> None:
    """Write the episode at its own pace; raise BadInputError when it cannot be written."""
    pictures = [
        Image.fromarray(draw_picture(state, task.x_limit_m)).resize((360, 240)).quantize(COLOURS)
        for state in episode.states[::STEPS_A_PICTURE]
    ]
    packed = io.BytesIO()
    millis = round(1000 * STEPS_A_PICTURE * task.step_s)
    pictures[0].save(
        packed, "GIF", save_all=True, append_images=pictures[1:], duration=millis, loop=0
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(packed.getvalue())
    except OSError as error:
        raise BadInputError(
            f"{path}: expected a place for the animation, found {error.strerror}"
        ) from error

"""Write an episode as a video (MP4) or as an animation (GIF)."""

from __future__ import annotations

import contextlib
import io
import os
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pendulum_rl_env.picture import HEIGHT, WIDTH, draw_picture
from pendulum_rl_env.scoring import Episode
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically

STEPS_A_PICTURE = 2  # many viewers play GIFs of more than 20 pictures a second too slowly
COLOURS = 16
SIZE_PX = (360, 240)
SUFFIXES = (".mp4", ".gif")


def check_video_path(path: Path) -> None:
    """Raise BadInputError when no video can be written under this name."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadInputError(
            f"{path}: expected a name that ends in {' or '.join(SUFFIXES)}, found "
            f"{suffix or 'no ending'}"
        )
    if suffix == ".mp4":
        _import_encoder(path)


def save_video(episode: Episode, task: Task, path: Path) -> None:
    """Write the episode at its own pace; raise BadInputError when it cannot be written."""
    check_video_path(path)
    try:
        if path.suffix.lower() == ".mp4":
            _save_mp4(_draw_states(episode, task, 1), task.step_s, path)
        else:
            _save_gif(_draw_states(episode, task, STEPS_A_PICTURE), task.step_s, path)
    except OSError as error:
        raise BadInputError(
            f"{path}: expected a place for the video, found {error.strerror or error}"
        ) from error


def _draw_states(episode: Episode, task: Task, every: int) -> list[NDArray[np.uint8]]:
    """Return the pictures of every so many states, with the time."""
    return [
        draw_picture(episode.states[k], task.x_limit_m, k * task.step_s)
        for k in range(0, len(episode.states), every)
    ]


def _save_gif(pictures: list[NDArray[np.uint8]], step_s: float, path: Path) -> None:
    images = [Image.fromarray(picture).resize(SIZE_PX).quantize(COLOURS) for picture in pictures]
    content = io.BytesIO()
    millis = round(1000 * STEPS_A_PICTURE * step_s)
    images[0].save(
        content, "GIF", save_all=True, append_images=images[1:], duration=millis, loop=0
    )
    write_atomically(path, content.getvalue())


def _save_mp4(pictures: list[NDArray[np.uint8]], step_s: float, path: Path) -> None:
    """Write H.264 beside the path and move it there when it is whole."""
    encoder = _import_encoder(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(suffix=".mp4", dir=path.parent)
    os.close(handle)
    try:
        frames = encoder.write_frames(name, (WIDTH, HEIGHT), fps=1 / step_s, macro_block_size=16)
        frames.send(None)
        for picture in pictures:
            frames.send(np.ascontiguousarray(picture))
        frames.close()
        Path(name).chmod(
            0o644
        )  # as `write_atomically` does: a temporary file is its owner's alone
        Path(name).replace(path)
    finally:
        with contextlib.suppress(OSError):
            Path(name).unlink()


def _import_encoder(path: Path):  # type: ignore[no-untyped-def]
    try:
        import imageio_ffmpeg  # type: ignore[import-untyped]
    except ImportError as error:
        raise BadInputError(
            f"{path}: expected imageio-ffmpeg for MP4, found it not installed: pip install "
            "imageio-ffmpeg, or give a name that ends in .gif"
        ) from error
    return imageio_ffmpeg

"""Pictures, windows and videos of episodes, as Gymnasium's users make them."""

import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image
from support.paths import ROOT

import pendulum_rl_env  # noqa: F401 (registers)
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.in_process import make_twin_env
from pendulum_rl_env.picture import INK, SCALE_PX, draw_picture
from pendulum_rl_env.scoring import Episode
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import check_video_path, save_video
from pendulum_twin.errors import BadInputError

IDS = ("pendulum_rl_env/InvertedPendulum-v0", "pendulum_rl_env/SamplePendulum-v0")
HANGING = np.array([0.0, np.pi, 0.0, 0.0])
EPISODE = Episode(1.0, 9, "none", np.tile(HANGING, (10, 1)), np.zeros(9))


def find_ticks(half_rail_m: float) -> int:
    """Count the ticks of the scale."""
    row = draw_picture(HANGING, half_rail_m)[SCALE_PX + 3]
    return int(np.sum(np.all(row == INK, axis=-1)))


def test_a_scale_has_a_tick_every_ten_centimetres() -> None:
    assert find_ticks(0.7) == 15 and find_ticks(0.4) == 9


def test_the_time_stands_in_the_corner() -> None:
    without, early, late = (draw_picture(HANGING, 0.7, t) for t in (None, 0.0, 1.5))
    corner = np.s_[:25, :80]
    assert (without[corner] == 255).all() and not np.array_equal(early[corner], late[corner])
    assert np.array_equal(early[25:], late[25:])


@pytest.mark.parametrize("name", IDS)
def test_a_picture_follows_the_episode(name: str) -> None:
    env = gym.make(name, render_mode="rgb_array")
    env.reset(seed=1)
    pictures = [env.render()]
    for _ in range(3):
        env.step(env.action_space.sample())
        pictures.append(env.render())
    assert all(picture.shape == (320, 480, 3) for picture in pictures)
    assert not np.array_equal(pictures[0], pictures[3])
    env.close()


@pytest.mark.parametrize("name", IDS)
def test_a_window_shows_every_step_by_itself(name: str, monkeypatch) -> None:
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gym.make(name, render_mode="human")
    env.reset(seed=1)
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).copy()
    for _ in range(3):
        env.step(env.action_space.sample())
    assert not np.array_equal(shown, pygame.surfarray.array3d(pygame.display.get_surface()))
    env.close()
    assert pygame.display.get_surface() is None
    env.close()


@pytest.mark.parametrize("step_s", [0.01, 0.03, 0.1])
def test_pictures_are_played_at_the_pace_of_the_steps(step_s: float) -> None:
    env = gym.make(IDS[0], step_s=step_s)
    assert env.metadata["render_fps"] == round(1 / step_s)
    assert env.metadata["render_modes"] == ["human", "rgb_array"]
    env.close()
    assert PendulumEnv.metadata["render_fps"] == 33


def test_another_mode_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected human, rgb_array or None, found 'jpeg'"):
        make_twin_env(render_mode="jpeg")


def test_a_window_without_pygame_is_refused(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(BadInputError, match="pip install pygame"):
        gym.make(IDS[0], render_mode="human")


def test_a_video_is_one_that_plays(tmp_path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    save_video(EPISODE, Task(), tmp_path / "episode.mp4")
    frames, seconds = ffmpeg.count_frames_and_secs(tmp_path / "episode.mp4")
    assert frames == 10 and seconds == pytest.approx(0.3, abs=0.02)
    save_video(EPISODE, Task(), tmp_path / "episode.gif")
    assert Image.open(tmp_path / "episode.gif").n_frames >= 1
    assert {path.name for path in tmp_path.iterdir()} == {"episode.mp4", "episode.gif"}
    assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o644}


def test_other_names_of_videos_are_refused(tmp_path, monkeypatch) -> None:
    with pytest.raises(BadInputError, match=r"ends in \.mp4 or \.gif, found \.avi"):
        check_video_path(tmp_path / "episode.avi")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(BadInputError, match="pip install imageio-ffmpeg"):
        check_video_path(tmp_path / "episode.mp4")
    check_video_path(tmp_path / "episode.gif")


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_place_that_is_none_is_refused(tmp_path, suffix: str) -> None:
    pytest.importorskip("imageio_ffmpeg")
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(BadInputError, match="expected a place for the video"):
        save_video(EPISODE, Task(), tmp_path / "file" / f"episode{suffix}")


def test_gymnasium_records_a_video_of_the_example(tmp_path) -> None:
    pytest.importorskip("moviepy")
    program = [sys.executable, str(ROOT / "examples" / "gym_loop.py"), "--video", str(tmp_path)]
    done = subprocess.run(program, check=True, capture_output=True, text=True)
    assert done.stdout.startswith("episode 0: reward ")
    assert (tmp_path / "rl-video-episode-0.mp4").stat().st_size > 1000

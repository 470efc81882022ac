"""Draw a training's evaluations as a picture, for those who open no TensorBoard."""

from __future__ import annotations

import io
from pathlib import Path

from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS
from pendulum_rl_env.learning.result import SOLVED_MEAN_REWARD, Result
from pendulum_twin.files import write_atomically


def draw_curves(result: Result, path: Path) -> None:
    """Write the mean rewards of all evaluations over the steps as PNG."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    steps = [row["steps"] for row in result.evaluations]
    means = [row["mean_reward"] for row in result.evaluations]
    figure, axes = pyplot.subplots(figsize=(7, 4), layout="constrained")
    axes.plot(steps, means, "o-", ms=3, label="evaluation, without exploration")
    if result.environment in (IN_PROCESS, OVER_TOPICS):
        solved = f"{SOLVED_MEAN_REWARD:g}: solved"
        axes.axhline(SOLVED_MEAN_REWARD, color="0.6", lw=0.8, label=solved)
    axes.set_xlabel("steps")
    axes.set_ylabel("mean reward of an episode")
    axes.set_title(
        f"{result.environment}, {result.preset} ({result.algorithm}), seed {result.seed}"
    )
    axes.legend(loc="lower right")
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=120)
    pyplot.close(figure)
    write_atomically(path, content.getvalue())

"""The table and the picture of the study of adaptation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

MEAN_S = 3.0  # over which the picture's reward is averaged
STEPS = 512  # of an episode, to which the picture's reward is scaled
STAGES = (  # of a change: when it ends, and what is done until then
    ("noticed_s", "watch"),
    ("recorded_s", "recording"),
    ("diagnosed_s", "diagnosis"),
    ("trained_s", "training"),
)
SHADES = ("tab:red", "tab:blue", "tab:purple", "tab:green")


def format_table(study: Mapping[str, Any]) -> str:
    """Return a row for each change, and beneath it what watch and diagnosis said, in Markdown."""
    controllers = list(dict.fromkeys(name for row in study["changes"] for name in _collect(row)))
    lines = [
        "| change | noticed, s | recorded | diagnosed | trained | new policy's first episode over "
        f"| {' | '.join(controllers)} |",
        "|" + "---|" * (6 + len(controllers)),
    ]
    for row in study["changes"]:
        times = [row["noticed_s"], *[row[key] for key, _ in STAGES[1:]], row["back_s"]]
        rewards = _collect(row)
        lines.append(
            f"| {row['change']} | {' | '.join(f'{seconds:.0f}' for seconds in times)} | "
            + " | ".join(_format_rewards(rewards.get(name, [])) for name in controllers)
            + " |"
        )
    for row in study["changes"]:
        lines += [
            "",
            f"{row['change']}:",
            f"- watch: {row['alarm'] or 'nothing'}",
            f"- diagnosis: {' '.join([row['sentence'], *row['warnings']])}",
        ]
    return "\n".join(lines)


def _collect(row: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return the rewards of each controller's whole episodes on the changed rig."""
    rewards: dict[str, list[float]] = {}
    for episode in row["episodes"]:
        if episode["start_s"] > row["trained_s"]:
            rewards.setdefault(episode["controller"], []).append(episode["reward"])
    return rewards


def _format_rewards(rewards: Sequence[float]) -> str:
    return ", ".join(f"{reward:.0f}" for reward in rewards) or "-"


def draw_rewards(study: Mapping[str, Any], path: Path) -> None:
    """Draw the reward over time, a panel for each change."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    rows = study["changes"]
    figure, panels = pyplot.subplots(
        len(rows), 1, figsize=(9, 2.4 * len(rows)), layout="constrained", squeeze=False
    )
    for row, axes in zip(rows, panels[:, 0], strict=True):
        begin_s = 0.0
        for (key, words), shade in zip(STAGES, SHADES, strict=True):
            axes.axvspan(begin_s, row[key], color=shade, alpha=0.12, label=words)
            begin_s = row[key]
        colours: dict[str, str] = {}
        for episode in row["episodes"]:
            name = episode["controller"]
            colour = colours.setdefault(name, f"C{len(colours)}")
            width = max(1, round(MEAN_S / episode["step_s"]))
            rewards = np.array(episode["rewards"])
            if len(rewards) < width:
                continue
            smooth = np.convolve(rewards, np.full(width, STEPS / width), "valid")
            times = episode["start_s"] + episode["step_s"] * np.arange(width, len(rewards) + 1)
            label = name if name not in axes.get_legend_handles_labels()[1] else None
            axes.plot(times, smooth, color=colour, lw=1, label=label)
        axes.axhline(study["good"], color="0.4", lw=0.7, ls="--")
        axes.set_ylim(-20, STEPS)
        axes.set_title(row["change"], fontsize=9)
        axes.set_ylabel("reward, of 512")
        axes.legend(fontsize=6, loc="lower left", ncols=2)
    panels[-1, 0].set_xlabel("time from the change, s")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)

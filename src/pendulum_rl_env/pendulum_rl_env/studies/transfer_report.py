"""The table and the picture of a transfer study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.scoring import describe_reward

ROWS = {
    "nominal": "nominal twin, no step on the rig",
    "identified": "identified twin, no step on the rig",
    "fine_tuned": "the same, trained on the rig where it fell short",
    "classical": "swing-up by energy and LQR, from the identified twin",
    "scratch": "from nothing, every step on the rig (preset frugal)",
}
DRAWS = 10_000


def compute_interval(values: np.ndarray) -> tuple[float, float]:
    """Return the 95 % interval of the mean by bootstrap over rigs (percentiles; Efron and Tibshirani 1993, chapter 13)."""
    random = np.random.default_rng(0)
    means = random.choice(values, (DRAWS, len(values))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def format_table(told: Mapping[str, Any]) -> str:
    """Return the study as Markdown: a row a controller over all rigs, then a row a rig."""
    rigs, mark = told["rigs"], told["mark"]
    lines = [
        f"| controller | mean reward [95 %] | least | rigs above {mark:g} | what one sees (at the mean) |",
        "|---|---|---|---|---|",
    ]
    rows = {
        name: words for name, words in ROWS.items() if any(name in rig["rewards"] for rig in rigs)
    }
    for name, words in rows.items():
        mean = np.array([np.mean(rig["rewards"][name]) for rig in rigs if name in rig["rewards"]])
        low, high = compute_interval(mean)
        above = int(np.sum(mean > mark))
        figures = f"{mean.mean():.0f} [{low:.0f}, {high:.0f}] | {mean.min():.0f} | {above} of {len(mean)}"
        lines.append(f"| {words} | {figures} | {describe_reward(float(mean.mean()))} |")
    lines += [
        "",
        "| rig | concealed | named | " + " | ".join(rows) + " |",
        "|" + "---|" * (3 + len(rows)),
    ]
    for rig in rigs:
        rewards = " | ".join(
            f"{np.mean(rig['rewards'][name]):.0f}" if name in rig["rewards"] else "-"
            for name in rows
        )
        concealed, named = (
            ", ".join(rig["concealed"]) or "nothing",
            ", ".join(rig["named"]) or rig["outcome"],
        )
        lines.append(f"| {rig['number']} | {concealed} | {named} | {rewards} |")
    return "\n".join(lines)


def plot_rewards(told: Mapping[str, Any], path: Path) -> None:
    """Draw every rig's reward, a column a controller."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 4.5), layout="constrained")
    rows = {
        name: words
        for name, words in ROWS.items()
        if any(name in rig["rewards"] for rig in told["rigs"])
    }
    for rig in told["rigs"]:
        rewards = [np.mean(rig["rewards"].get(name, np.nan)) for name in rows]
        axes.plot(range(len(rows)), rewards, "o-", color="0.6", lw=0.7, ms=5)
    axes.axhline(
        told["mark"],
        color="tab:red",
        lw=1,
        label=f"{told['mark']:g}: the thesis, after 130,000 steps on the rig",
    )
    axes.set_xticks(
        range(len(rows)), [words.replace(", ", ",\n") for words in rows.values()], fontsize=7
    )
    axes.set_ylabel("reward of an episode on the rig")
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=120)
    pyplot.close(figure)

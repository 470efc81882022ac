"""The table and the picture of a transfer study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.scoring import describe_reward
from pendulum_twin.arrays import Floats

ROWS = {
    "nominal": "nominal twin, no step on the rig",
    "identified": "identified twin, no step on the rig",
    "fine_tuned": "the same, trained on the rig where it fell short",
    "residual": "planned swing-up, LQR and learned correction (preset residual)",
    "refitted": "preset residual in the nominal twin with constants refitted, no physics added",
    "real_time": "the policy of preset residual over topics, in real time",
    "planned": "planned swing-up and LQR, from the identified twin",
    "classical": "swing-up by energy and LQR, from the identified twin",
    "predictive": "predictive control (MPC), from the identified twin",
    "optimum": "optimum of the identified twin, in this twin itself",
    "scratch": "from nothing, every step on the rig (preset frugal)",
}
DEFAULT_ROWS = ("nominal", "identified", "fine_tuned", "classical")
BOOTSTRAP_DRAWS = 10_000


def compute_interval(values: Floats) -> tuple[float, float]:
    """Return the 95 % interval of the mean by bootstrap over rigs.

    values: (rigs,) rewards.

    Source: percentiles; Efron and Tibshirani, An Introduction to the Bootstrap (1993), chapter 13.
    """
    random = np.random.default_rng(0)
    means = random.choice(values, (BOOTSTRAP_DRAWS, len(values))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def format_table(study: Mapping[str, Any]) -> str:
    """Return the study as Markdown: a row a controller over all rigs, then a row a rig."""
    rows = _select_rows(study)
    return "\n".join([*_list_controllers(study, rows), "", *_list_rigs(study, rows)])


def _select_rows(study: Mapping[str, Any]) -> dict[str, str]:
    """Return names and descriptions of the controllers that were tried on any rig."""
    tried = {name for rig in study["rigs"] for name in rig["rewards"]}
    return {name: words for name, words in ROWS.items() if name in tried}


def _list_controllers(study: Mapping[str, Any], rows: Mapping[str, str]) -> list[str]:
    rigs, mark = study["rigs"], study["mark"]
    lines = [
        f"| controller | mean reward [95 %] | least | rigs above {mark:g} "
        "| what one sees (at the mean) |",
        "|---|---|---|---|---|",
    ]
    for name, words in rows.items():
        means = np.array([np.mean(rig["rewards"][name]) for rig in rigs if name in rig["rewards"]])
        mean, (low, high) = float(means.mean()), compute_interval(means)
        above = f"{int(np.sum(means > mark))} of {len(means)}"
        lines.append(
            f"| {words} | {mean:.0f} [{low:.0f}, {high:.0f}] | {means.min():.0f} | {above} "
            f"| {describe_reward(mean)} |"
        )
    return lines


def _list_rigs(study: Mapping[str, Any], rows: Mapping[str, str]) -> list[str]:
    lines = [
        "| rig | concealed | named | " + " | ".join(rows) + " |",
        "|" + "---|" * (3 + len(rows)),
    ]
    for rig in study["rigs"]:
        rewards = " | ".join(
            f"{np.mean(rig['rewards'][name]):.0f}" if name in rig["rewards"] else "-"
            for name in rows
        )
        concealed = ", ".join(rig["concealed"]) or "nothing"
        named = ", ".join(rig["named"]) or rig["outcome"]
        lines.append(f"| {rig['number']} | {concealed} | {named} | {rewards} |")
    return lines


def plot_rewards(study: Mapping[str, Any], path: Path) -> None:
    """Draw every rig's reward, a column a controller."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 4.5), layout="constrained")
    rows = _select_rows(study)
    for rig in study["rigs"]:
        rewards = [np.mean(rig["rewards"].get(name, np.nan)) for name in rows]
        axes.plot(range(len(rows)), rewards, "o-", color="0.6", lw=0.7, ms=5)
    mark = f"{study['mark']:g}: the thesis, after 130,000 steps on the rig"
    axes.axhline(study["mark"], color="tab:red", lw=1, label=mark)
    labels = [words.replace(", ", ",\n") for words in rows.values()]
    axes.set_xticks(range(len(rows)), labels, fontsize=7)
    axes.set_ylabel("reward of an episode on the rig")
    axes.legend(loc="lower right")
    figure.savefig(path, dpi=120)
    pyplot.close(figure)

"""Measure what `docs/fleet.md` says of sizes: a history of sixty days, and what pooling gains."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from fleet_recordings import CALM, CHANGED, VARIED, make_siblings, make_sixty_days
from study_fleet import name_new_store, parse_arguments, run, run_studies

from pendulum_sysid.decisions import INTERVAL_DEVIATIONS
from pendulum_sysid.fleet.history import describe_history, read_histories
from pendulum_sysid.fleet.pooling import pool_estimates, pool_family
from pendulum_sysid.fleet.store import Store


def study_history(out: Path) -> None:
    """Print what a history of 60 days with three changes, and those of calm rigs, say."""
    folder, store = make_sixty_days(out), name_new_store(out, "store_history")
    run(folder, store, "--workers", "2")
    histories = {history.rig: history for history in read_histories(Store(str(store)))}
    print("  " + "\n  ".join(describe_history(histories[CHANGED])))
    alarms = [rig for rig in CALM if histories[rig].changes or histories[rig].drifts]
    print(f"  {len(CALM)} calm rigs: {len(alarms)} with a change {alarms}")


def study_pooling(out: Path) -> None:
    """Print how much sharper pooled intervals are, and how often they hold the truth.

    Every rig has a few recordings of 6 s. A recording alone, the rig's recordings pooled, and the
    rig among its siblings are compared.
    """
    (folder, siblings), store = make_siblings(out), name_new_store(out, "store_siblings")
    run(folder, store, "--workers", "2")
    sizes = Store(str(store)).read_sizes()
    for name in VARIED:
        groups, truths = [], []
        for rig, group in sizes[sizes["parameter"] == name].groupby("rig"):
            errors = (group["high"] - group["low"]).to_numpy() / (2 * INTERVAL_DEVIATIONS)
            groups.append((group["value"].to_numpy(), errors))
            truths.append(siblings[rig].rig.to_mapping()[name])
        alone = [
            (v - INTERVAL_DEVIATIONS * e, v + INTERVAL_DEVIATIONS * e, truth)
            for (values, errors), truth in zip(groups, truths, strict=True)
            for v, e in zip(values, errors, strict=True)
        ]
        own = [pool_estimates(*group) for group in groups]
        pooled, among = (
            [(p.low, p.high, truth) for p, truth in zip(rigs, truths, strict=True)]
            for rigs in (own, pool_family(groups).rigs)
        )
        words = (describe_intervals(rows) for rows in (alone, pooled, among))
        print(f"  {name}: " + "; ".join(words))


def describe_intervals(rows: list[tuple[float, float, float]]) -> str:
    """Tell the median half width of intervals, in per cent of the truth, and how many hold it."""
    half = np.median([(high - low) / 2 / truth for low, high, truth in rows])
    inside = sum(low <= truth <= high for low, high, truth in rows)
    return f"+-{100 * half:.2g} %, {inside} of {len(rows)} hold the truth"


STUDIES: dict[str, Callable[[Path], None]] = {
    "history": study_history,
    "pooling": study_pooling,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the studies; return the exit status."""
    out, chosen = parse_arguments("study_fleet_sizes", __doc__, STUDIES, arguments)
    return run_studies("study_fleet_sizes", out, chosen, STUDIES)


if __name__ == "__main__":
    sys.exit(main())

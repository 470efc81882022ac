"""False alarms and pooled sizes of drawn histories; run from the root of the workspace.

python tests/bench/fleet.py quiet SEED REPEATS DAYS  false alarms of quiet histories
python tests/bench/fleet.py pooled                   widths and coverage of pooled sizes
"""

import sys

import numpy as np

from pendulum_sysid.fleet.changes import count_changes, find_changes
from pendulum_sysid.fleet.pooling import pool_estimates, pool_family


def quiet(seed: str, repeats: str, days: str) -> None:
    rng, n, sizes = np.random.default_rng(int(seed)), int(days), 5
    for name, draw in (
        ("Gaussian", rng.normal),
        ("Student's t, 4", lambda size: rng.standard_t(4, size)),
    ):
        for spread in (0.0, 1.0):
            alarms = 0
            for _ in range(int(repeats)):
                courses = []
                for _ in range(sizes):
                    errors = rng.uniform(0.5, 2.0, n)
                    values = draw(size=n) * np.hypot(errors, spread)
                    courses.append(find_changes(np.arange(n) * 86400.0, values, errors, sizes))
                alarms += count_changes(courses) > 0
            print(f"{name}, spread {spread:g}, {n} recordings: {alarms} of {repeats} rigs")


def pooled() -> None:
    rng = np.random.default_rng(3)
    print("| rigs | recordings | rig to rig | to recording | alone | true | pooled | true |")
    for count, rigs, between, within in (
        (1, 10, 0.5, 0.0), (3, 10, 0.5, 0.0), (10, 10, 0.5, 0.0), (3, 10, 0.5, 0.5),
        (3, 30, 0.2, 0.2), (3, 10, 0.0, 0.0), (3, 4, 0.5, 0.2),
    ):  # fmt: skip
        alone, together = [], []
        for _ in range(60):
            truths, groups = 10.0 + between * rng.normal(size=rigs), []
            for truth in truths:
                errors = rng.uniform(0.5, 2.0, count)
                scatter = np.hypot(errors, within)
                groups.append((truth + scatter * rng.normal(size=count), errors))
            family = pool_family(groups)
            for truth, rig, group in zip(truths, family.rigs, groups, strict=True):
                own, width = pool_estimates(*group), 2 * 1.96 * np.median(group[1])
                alone.append(((own.high - own.low) / width, own.low <= truth <= own.high))
                together.append(((rig.high - rig.low) / width, rig.low <= truth <= rig.high))
        figures = [
            f"{np.median([w for w, _ in rows]):.2f} | {np.mean([i for _, i in rows]):.1%}"
            for rows in (alone, together)
        ]
        print(f"| {rigs} | {count} | {between} | {within} | {' | '.join(figures)} |")


if __name__ == "__main__":
    verbs = {"quiet": quiet, "pooled": pooled}
    if len(sys.argv) < 2 or sys.argv[1] not in verbs:
        sys.exit(__doc__)
    verbs[sys.argv[1]](*sys.argv[2:])

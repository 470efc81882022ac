"""Fuzz the commands of `sysid` with thousands of odd files: `python tests/fuzz/run.py`.

Prints how the cases of each kind ended, the longest time and the memory at its highest. Exit
status 1 when a case was answered wrongly; each is then printed.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import time
from collections import Counter
from pathlib import Path

import hypothesis

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.fuzzing import CASES, LONGEST_S, Case, list_faults, run_case

MOST_MB = 1024


def main() -> int:
    """Run the cases, print the table, and return 1 when one of them was answered wrongly."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", type=int, default=2000, help="how many (2000)")
    parser.add_argument("--seed", type=int, default=1, help="what they are drawn from (1)")
    options = parser.parse_args()
    counts: Counter[tuple[str, int]] = Counter()
    wrong: list[str] = []
    longest: list[tuple[float, str]] = [(0.0, "")]

    @hypothesis.seed(options.seed)
    @hypothesis.settings(
        max_examples=options.cases,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
        deadline=None,
        database=None,
    )
    @hypothesis.given(CASES)
    def ask(case: Case) -> None:
        result = run_case(case)
        counts[case.kind, result.status] += 1
        longest[0] = max(longest[0], (result.seconds, repr(case)))
        wrong.extend(f"{case!r}: {fault}" for fault in list_faults(result))

    began = time.monotonic()
    ask()
    print(f"{'kind':14}{'answered':>10}{'refused':>10}{'wrong use':>10}")
    for kind in sorted({kind for kind, _ in counts}):
        print(f"{kind:14}" + "".join(f"{counts[kind, status]:10}" for status in (0, 1, 2)))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{sum(counts.values())} cases in {time.monotonic() - began:.0f} s, {len(wrong)} wrong")
    print(f"longest {longest[0][0]:.1f} s ({longest[0][1]}), memory at most {peak:.0f} MB")
    print(*dict.fromkeys(wrong), sep="\n")
    too_much = longest[0][0] > LONGEST_S or peak > MOST_MB
    return 1 if wrong or too_much else 0


if __name__ == "__main__":
    random.seed(0)
    sys.exit(main())

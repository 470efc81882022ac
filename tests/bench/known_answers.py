"""Every known answer, diagnosed: physics is hidden in made recordings and has to be found.

Run as `python tests/bench/known_answers.py [--only WORD]`. The exit status is 1 when an answer is
wrong or fewer than 90 % of the 95 % intervals hold the truth.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from support.known_answers import ANSWERS, diagnose_case, list_intervals, list_mistakes

LEAST_COVERAGE = 0.9


def main() -> int:
    """Print a line a case as soon as it is diagnosed, then the totals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", metavar="WORD", help="cases with this in the name")
    word = parser.parse_args().only
    cases = [case for name, case in ANSWERS.items() if word in name]
    wrong, inside = 0, []
    for case in cases:
        began = time.monotonic()
        verdict = diagnose_case(case.name)
        seconds = time.monotonic() - began
        mistakes = list_mistakes(case, verdict)
        wrong += bool(mistakes)
        inside += list_intervals(case, verdict)
        print(f"{seconds:6.1f} s  {case.name}: {'; '.join(mistakes) or 'right'}", flush=True)
    coverage = sum(inside) / max(len(inside), 1)
    print(f"{len(cases) - wrong} of {len(cases)} answers are right")
    print(f"{sum(inside)} of {len(inside)} intervals hold the truth ({100 * coverage:.1f} %)")
    return int(bool(wrong) or coverage < LEAST_COVERAGE)


if __name__ == "__main__":
    sys.exit(main())

"""The programs `train` and `evaluate`: help and completion come before torch is imported."""

from __future__ import annotations

import sys
import time

from pendulum_rl_env.options import parse_evaluate_options, parse_train_options


def run_train() -> int:
    """Run `train` with the command line of the process; return its exit status."""
    started_s = time.monotonic()
    parse_train_options(None)  # ends here for --help, --version, a completion and wrong use
    from pendulum_rl_env.train import main

    return main(sys.argv[1:], started_s)


def run_evaluate() -> int:
    """Run `evaluate` with the command line of the process; return its exit status."""
    parse_evaluate_options(None)
    from pendulum_rl_env.evaluate import main

    return main(sys.argv[1:])

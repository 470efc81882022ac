"""The verb `import`: columns of a CSV file as a recording."""

from __future__ import annotations

import argparse

from pendulum_sysid.reading.csv_import import import_csv
from pendulum_sysid.verbs.said import ANSWERED


def run(arguments: argparse.Namespace) -> int:
    """Write the recording and print its name."""
    if arguments.cart is None and arguments.pole is None:
        arguments.parser.error("expected --cart, --pole or both, found neither")
    import_csv(
        arguments.csv,
        arguments.out,
        time=arguments.time,
        command=arguments.command,
        cart=arguments.cart,
        pole=arguments.pole,
        pole_zero=arguments.pole_zero,
        skip=arguments.skip,
        invert_cart=arguments.invert_cart,
        invert_pole=arguments.invert_pole,
    )
    print(arguments.out)
    return ANSWERED

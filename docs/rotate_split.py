"""Diagnose a recording for every rotation of the split: how far do names and errors depend on it?

Run as `python docs/rotate_split.py BAG TWIN`.
"""

import sys

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting import split
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.bag import read_bag
from pendulum_twin.model import load_twin


def main() -> None:
    """Print names and held-out errors, a line for each rotation."""
    recording, twin = clean_recording(read_bag(sys.argv[1])), load_twin(sys.argv[2])
    pattern = split.PATTERN
    for k in range(len(pattern)):
        split.PATTERN = pattern[k:] + pattern[:k]
        found = diagnose([recording], twin, lambda line: None).to_dict()
        errors = {
            name: one["after"]
            for name, one in found["fit"].items()
            if name.startswith("held_out_")
        }
        names = ", ".join(one["effect"] for one in found["missing_physics"])
        print(
            k,
            found["outcome"],
            {name: float(f"{value:.3g}") for name, value in errors.items()},
            names,
            flush=True,
        )


if __name__ == "__main__":
    main()

"""The cost of a diagnosis as recordings grow: CPU seconds and peak memory.

The recordings are the twin's own, of a rig with dry friction and a delay. Each length has a
process of its own with one thread; machine code is compiled beforehand. Run as
`python tests/bench/lengths.py --minutes 1 10 60`.
"""

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO

from pendulum_sysid.fleet.engine import ONE_THREAD
from pendulum_sysid.fleet.warm_up import compile_kernels
from pendulum_sysid.pipeline import diagnose

EFFECTS = {"cart_coulomb_friction": {"level_n": 0.5}, "input_delay": {"delay_s": 0.023}}
SEED = 5
PEAK, FORGET_PEAK = "VmHWM:", "5"  # of the process alone; getrusage counts the parent's memory in


@dataclass(frozen=True)
class Cost:
    """Hold the cost of a diagnosis and its sentence.

    minutes: length of the recording.
    cpu_s: CPU time, s.
    memory_mb: peak memory, MB.
    """

    minutes: float
    cpu_s: float
    memory_mb: float
    sentence: str

    def format_row(self, shortest: "Cost") -> str:
        """Return a row of the table; ratios are to the shortest recording."""
        seconds, memory = self.cpu_s / shortest.cpu_s, self.memory_mb / shortest.memory_mb
        return (
            f"| {self.minutes:g} | {self.cpu_s:.0f} | {self.cpu_s / self.minutes:.1f} "
            f"| {self.memory_mb:.0f} | {self.minutes / shortest.minutes:g} | {seconds:.1f} "
            f"| {memory:.1f} | {self.sentence} |"
        )


def measure_cost(minutes: float) -> Cost:
    """Return the cost of a diagnosis in a process that does nothing else."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "recording.pickle"
        path.write_bytes(pickle.dumps(record_hidden(EFFECTS, SEED, 60.0 * minutes)[0]))
        command = [sys.executable, __file__, "--one", path]
        done = subprocess.run(
            command, env={**os.environ, **ONE_THREAD}, stdout=subprocess.PIPE, check=True
        )
    return Cost(minutes, **json.loads(done.stdout))


def diagnose_file(path: Path) -> dict:
    """Return CPU seconds, peak memory and the sentence of a diagnosis in this process."""
    recording = pickle.loads(path.read_bytes())
    compile_kernels()
    Path("/proc/self/clear_refs").write_text(
        FORGET_PEAK, encoding="ascii"
    )  # what compiling took is not the diagnosis's
    began = time.process_time()
    verdict = diagnose([recording], INTECO, lambda line: print(line, file=sys.stderr, flush=True))
    return {
        "cpu_s": time.process_time() - began,
        "memory_mb": read_peak_mb(),
        "sentence": verdict.sentence,
    }


def read_peak_mb() -> float:
    """Return the largest memory that this process has held, MB."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(PEAK)) / 1024


def main() -> None:
    """Print the table, a row as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, nargs="+", default=[1.0, 10.0, 60.0])
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(diagnose_file(options.one)))
        return
    print(
        "| minutes | CPU s | CPU s a minute | peak MB | minutes, ratio | CPU, ratio "
        "| memory, ratio | verdict |"
    )
    print("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | :--- |", flush=True)
    shortest = None
    for minutes in sorted(options.minutes):
        cost = measure_cost(minutes)
        shortest = shortest or cost
        print(cost.format_row(shortest), flush=True)


if __name__ == "__main__":
    main()

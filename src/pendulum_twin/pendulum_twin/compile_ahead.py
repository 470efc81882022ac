"""Compile the kernel before it is needed, in a process that can be interrupted.

A compiler at work hears no signal for seconds. So a program that runs a live twin lets a child
process compile, waits for it, and hears Ctrl-C meanwhile. The machine code is kept
(`machine_code`), so that this happens once for all clones of the same sources. As a program, with
--all, it compiles what the diagnosis of recordings needs, too.
"""

from __future__ import annotations

import hashlib
import os
import select
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from pendulum_twin.command_line import add_version
from pendulum_twin.parser import Parser
from pendulum_twin.stop_request import StopRequest

LOOK_S = 0.1  # from one look for a signal or for the child's progress to the next
MODULE = "pendulum_twin.compile_ahead"
SECONDS = 15  # on a desktop of 2024, one core
ALL = "--all"


def prepare_kernel(name: str, stopped: StopRequest) -> bool:
    """Compile what a live twin needs, unless that was done before; return False when interrupted.

    name: of the program, before its messages on stderr.
    stopped: ends the compiling at once when it is set.

    A child that fails is not told: the program then compiles by itself, and says what is wrong.
    """
    mark = _find_mark("live")
    if mark is None or mark.is_file():
        return True
    _say(name, f"compiling the twin once (about {SECONDS} s)")
    child = subprocess.Popen(
        [sys.executable, "-m", MODULE], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    try:
        return _follow(child, name, stopped)
    finally:
        child.kill()
        child.wait()
        if child.stdout is not None:
            child.stdout.close()


def _follow(child: subprocess.Popen[bytes], name: str, stopped: StopRequest) -> bool:
    """Show the child's progress until it ends; return False when `stopped` is set before."""
    assert child.stdout is not None
    output = child.stdout.fileno()
    while not stopped.is_set():
        if select.select([output], [], [], LOOK_S)[0]:
            lines = os.read(output, 4096).decode()
            if not lines:
                return True
            for line in lines.splitlines():
                _say(name, line)
    return False


def _say(name: str, line: str) -> None:
    print(f"{name}: {line}", file=sys.stderr, flush=True)


def _find_mark(what: str) -> Path | None:
    """Return the file that says that all is compiled; None when machine code is not kept.

    Machine code is made for a processor, by versions of Python and of the compiler.
    """
    import numba
    from numba.core.registry import cpu_target

    from pendulum_twin.machine_code import find_cache_folder

    folder = find_cache_folder()
    processor = cpu_target.target_context.codegen().magic_tuple()
    made_for = (sys.version, numba.__version__, *processor)
    digest = hashlib.sha256("\n".join(map(str, made_for)).encode()).hexdigest()[:16]
    return None if folder is None else folder / f"compiled-{what}-{digest}"


def _list_live_units() -> list[Callable[[], object]]:
    """Return what a live twin calls, a call for each piece of machine code."""
    from pendulum_twin.model import Twin
    from pendulum_twin.motion import LAW_SETS
    from pendulum_twin.rig import Rig
    from pendulum_twin.sensors import compile_sensors
    from pendulum_twin.stepper import Stepper

    twin = Twin("any", Rig(cart_mass_kg=1.0, force_per_pwm_n=1.0, cart_viscous_n_s_m=1.0))

    def step(laws: tuple[int, ...] | None) -> object:
        stepper = Stepper(twin, 0.01)
        stepper._laws = laws
        return stepper.step(0.0)

    return [
        partial(Stepper, twin, 0.01),
        compile_sensors,
        *(partial(step, laws) for laws in LAW_SETS),
    ]


def _list_fitting_units() -> list[Callable[[], object]]:
    """Return what free runs of many lanes call beside that."""
    import numpy as np

    from pendulum_twin import kernel
    from pendulum_twin.block import PATH_SIZE
    from pendulum_twin.motion import LAW_SETS
    from pendulum_twin.parameter_vector import NEUTRAL

    def run(laws: tuple[int, ...] | None) -> object:
        theta = NEUTRAL[None].copy()
        theta[:, :4] = 1.0
        first = np.zeros(kernel.WIDTH, dtype=np.int64)
        states, out = np.zeros((kernel.WIDTH, 4)), np.empty((kernel.WIDTH, 2, 4))
        paths = np.zeros((kernel.WIDTH, PATH_SIZE))
        block, drives = (0,) * kernel.WIDTH, np.zeros((1, 10))
        return kernel.integrate_lanes(
            block,
            laws,
            False,
            None,
            drives,
            first,
            first,
            first,
            states,
            paths,
            theta,
            first,
            1e-3,
            10,
            out,
        )

    return [partial(run, laws) for laws in LAW_SETS]


def main(arguments: Sequence[str] | None = None) -> int:
    """Compile all units, print the progress, and leave the mark; return the exit status."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)  # end at once, and silently
    examples = (f"python -m {MODULE} {ALL}",)
    parser = Parser(prog="compile_ahead", description=__doc__, examples=examples)
    add_version(parser)
    parser.add_argument(ALL, action="store_true", help="also what fits of recordings need")
    wanted = ["live", "fitting"] if parser.parse_args(arguments).all else ["live"]
    units = {"live": _list_live_units, "fitting": _list_fitting_units}
    for what in wanted:
        mark = _find_mark(what)
        if mark is None or mark.is_file():
            continue
        calls = units[what]()
        for k, call in enumerate(calls):
            # the end of the line in the same write, with PYTHONUNBUFFERED, too: `_follow` reads
            # what has come
            print(f"compiling for {what}: {k + 1} of {len(calls)}\n", end="", flush=True)
            call()
        mark.touch()
    return 0


if __name__ == "__main__":
    sys.exit(main())

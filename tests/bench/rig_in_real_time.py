"""How well the environment over topics keeps time on a rig, in steps of 30 ms.

Emulator and driver are processes of their own.

A gentle sine moves the cart; every episode's reset goes over the rig's service. `--busy N` adds
processes that do nothing but compute. Run as `python tests/bench/rig_in_real_time.py --episodes
20`; the table is Markdown.
"""

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS)]

from support.ros_graph import free_domain  # noqa: E402
from support.running_emulator import TWIN, free_ports  # noqa: E402

from pendulum_bridge.studies.programs import Programs, wait_for  # noqa: E402
from pendulum_rl_env.nodes.ros_env import make_ros_env  # noqa: E402

STEPS = 512
STEP_S = 0.03
START_S = 60.0
HOST = "127.0.0.1"
PERIOD_S, AMPLITUDE, CENTRING_1_M, DAMPING_S_M = 2.0, 0.2, 0.6, 0.2  # of the action, -1 to 1
WORK = "while True: pass"


@dataclass
class Timing:
    """Hold what was told of the steps of all episodes."""

    steps: list[dict[str, Any]] = field(default_factory=list)
    last: list[dict[str, Any]] = field(default_factory=list)  # of each episode: its counts
    reset_s: list[float] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)

    def of(self, name: str) -> np.ndarray:
        return np.array([step[name] for step in self.steps])

    def sum(self, name: str) -> int:
        return int(sum(each[name] for each in self.last))


@contextmanager
def rig(logs: Path) -> Iterator[None]:
    """Run an emulated rig and its driver in a ROS domain of their own and of this process."""
    with free_domain() as domain:
        graph = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        os.environ.update(graph)
        rig_port, listen_port = free_ports()
        addresses = ("--listen", f"{HOST}:{rig_port}", "--send", f"{HOST}:{listen_port}")
        ports = ("-p", f"rig_port:={rig_port}", "-p", f"listen_port:={listen_port}")
        with Programs(logs, graph) as programs:
            wait_for(
                programs.start("rig_emulator", "--twin", TWIN, *addresses), "listens on", START_S
            )
            arguments = ("--ros-args", "-r", "__ns:=/rig", "-p", f"twin:={TWIN}", *ports)
            wait_for(programs.start("driver_node", *arguments), "drives", START_S)
            yield


@contextmanager
def keep_cores_busy(count: int) -> Iterator[None]:
    """Run processes that compute."""
    workers = [subprocess.Popen([sys.executable, "-c", WORK]) for _ in range(count)]
    try:
        yield
    finally:
        for each in workers:
            each.kill()
            each.wait()


def choose_commands(k: int, seen: np.ndarray) -> np.ndarray:
    wave = AMPLITUDE * math.cos(2 * math.pi * k * STEP_S / PERIOD_S)
    return np.array([wave - CENTRING_1_M * seen[0] - DAMPING_S_M * seen[1]], dtype=np.float32)


def play(env: Any, timing: Timing) -> None:
    """Play an episode."""
    begin, total = time.monotonic(), 0.0
    seen, info = env.reset()
    timing.reset_s.append(time.monotonic() - begin)
    for k in range(STEPS):
        seen, reward, terminated, _, info = env.step(choose_commands(k, seen))
        total += reward
        timing.steps.append(info)
        if terminated:
            break
    timing.last.append(info)
    timing.rewards.append(total)


def format_table(timing: Timing, workers: int) -> list[str]:
    """Return the figures as a Markdown table."""
    names = ("dt_s", "delay_s", "age_s", "latency_s", "overrun_s")
    dt, delay, age, latency, overrun = (1e3 * timing.of(name) for name in names)
    exact = np.mean(np.abs(dt - 1e3 * STEP_S) < 1.0)
    rows = {
        "episodes": len(timing.last),
        "processes beside that compute": workers,
        "steps": len(timing.steps),
        "missed deadlines": timing.sum("missed"),
        "worst overrun, ms": f"{overrun.max():.2f}",
        "step by the stamps, ms: median, least, longest": (
            f"{np.median(dt):.2f}, {dt.min():.2f}, {dt.max():.2f}"
        ),
        "steps within 1 ms of 30 ms": f"{exact:.2%}",
        "delay, ms: median, worst": f"{np.median(delay):.2f}, {delay.max():.2f}",
        "age, ms: median, worst": f"{np.median(age):.2f}, {age.max():.2f}",
        "latency, ms: median, worst": f"{np.median(latency):.2f}, {latency.max():.2f}",
        "samples lost": timing.sum("lost"),
        "samples stale": timing.sum("stale"),
        "reset, s: median, worst": f"{np.median(timing.reset_s):.1f}, {max(timing.reset_s):.1f}",
        "summed reward: median": f"{np.median(timing.rewards):.1f}",
    }
    return [
        "| figure | found |",
        "|---|---|",
        *(f"| {name} | {value} |" for name, value in rows.items()),
    ]


def main() -> None:
    """Print the table, whatever ends the run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--busy", type=int, default=0, metavar="N")
    options = parser.parse_args()
    timing = Timing()
    with tempfile.TemporaryDirectory() as logs, rig(Path(logs)), keep_cores_busy(options.busy):
        env = make_ros_env(step_s=STEP_S)
        try:
            for number in range(options.episodes):
                play(env, timing)
                print(f"episode {number + 1}: {timing.last[-1]}", file=sys.stderr, flush=True)
        finally:
            env.close()
            if timing.last:
                print("\n".join(format_table(timing, options.busy)), flush=True)


if __name__ == "__main__":
    main()

"""The watch on rigs: false alarms on healthy rigs, delay and place of alarms on changed rigs.

The rigs are MuJoCo's, which shares nothing with the twin; every twin is off by up to 2 % in each
constant, as a diagnosis leaves it. Run as `python tests/bench/watching.py --rigs 20 --minutes 6
--seeds 8`; the tables are Markdown.
"""

import argparse
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from support.watched_rigs import (
    CHANGES,
    Change,
    Watched,
    Wire,
    drive,
    make_rig,
    make_twin,
    watch_run,
)

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.watch.watch import Watch

WIRES = {
    "clean": Wire(),
    "2 ms jitter": Wire(jitter_s=0.002),
    "2 % lost": Wire(lost=0.02),
    "both": Wire(0.002, 0.02),
}
COUNTS = (4096, 1024)
FIRST_S, LAST_S = 40.0, 95.0  # between these a rig changes
GIVE_UP_S = 45.0
THEN_S = 6.0  # after the alarm: by then it has been named once more


@dataclass(frozen=True)
class Setting:
    """Hold one rig's encoder counts and wire; settings take turns from seed to seed."""

    counts: int
    wire: str

    def __str__(self) -> str:
        return f"{self.counts} counts, {self.wire}"


def make_setting(seed: int) -> Setting:
    return Setting(COUNTS[seed % 2], list(WIRES)[seed // 2 % len(WIRES)])


def play(seed: int, seconds: float, change: Change | None = None, at_s: float = 0.0) -> Watched:
    setting, truth = make_setting(seed), make_rig(seed)

    def make(rig: Concealed, start: tuple[float, ...]) -> EmulatedRig:
        return EmulatedRig(
            rig, encoders=Encoders(pole_counts=setting.counts), seed=seed, start=start
        )

    run = drive(make, truth, seed, change, at_s)
    done = watch_run(
        Watch(make_twin(truth, seed)), run, seconds, WIRES[setting.wire], seed, THEN_S
    )
    said = f"{done.raised_s:.1f} s: {done.alarm.sentence}" if done.alarm else "no alarm"
    print(
        f"seed {seed}, {setting}, {change.name if change else 'healthy'} {at_s:.1f} s -> {said}",
        file=sys.stderr,
        flush=True,
    )
    return done


def watch_healthy(rigs: int, minutes: float) -> list[str]:
    """Watch healthy rigs and return a table of false alarms."""
    lines = [
        "| rigs | minutes | false alarms | learned after, s | share of a core |",
        "|---|---|---|---|---|",
    ]
    done = [(seed, play(seed, 60 * minutes)) for seed in range(rigs)]
    for name in sorted({str(make_setting(seed)) for seed, _ in done}):
        lines.append(
            _format_healthy(name, [one for seed, one in done if str(make_setting(seed)) == name])
        )
    lines.append(_format_healthy("all", [one for _, one in done]))
    alarms = [
        f"- seed {seed}, {one.raised_s:.1f} s: {one.alarm.sentence}"
        for seed, one in done
        if one.alarm
    ]
    return [*lines, *alarms]


def _format_healthy(name: str, done: list[Watched]) -> str:
    minutes = sum(one.seconds for one in done) / 60
    learned = [one.learned_s for one in done if one.learned_s is not None]
    share = sum(one.cpu_s for one in done) / sum(one.seconds for one in done)
    false = sum(one.alarm is not None for one in done)
    return (
        f"| {len(done)}: {name} | {minutes:.0f} | {false} | {np.median(learned):.0f} "
        f"| {share:.1%} |"
    )


def watch_changing(seeds: int) -> list[str]:
    """Change rigs while they are watched and return a table of what the watch said."""
    lines = [
        "| change | place | right at once | right 4 s later | delay, s: median (longest) "
        "| size found: median | missed |",
        "|---|---|---|---|---|---|---|",
    ]
    wrong = []
    for number, change in enumerate(CHANGES):
        done = [_watch_change(seed, change, number) for seed in range(100, 100 + seeds)]
        raised = [(one, at_s) for one, at_s in done if one.alarm is not None]
        right = sum(
            one.alarm.place.value == change.place and one.raised_s >= at_s for one, at_s in raised
        )
        later = sum(
            one.watch.alarm.place.value == change.place and one.raised_s >= at_s
            for one, at_s in raised
        )
        delays = [one.raised_s - at_s for one, at_s in raised] or [np.nan]
        sizes = [one.watch.alarm.size for one, _ in raised] or [np.nan]
        unit = raised[0][0].watch.alarm.unit if raised else ""
        lines.append(
            f"| {change.name} | {change.place} | {right} of {seeds} | {later} of {seeds} "
            f"| {np.median(delays):.1f} "
            f"({max(delays):.1f}) | {np.median(sizes):.3g} {unit} | {seeds - len(raised)} |"
        )
        wrong += [
            f"- {change.name}: {one.alarm.sentence}"
            for one, _ in raised
            if one.alarm.place.value != change.place
        ]
    return [*lines, *wrong]


def _watch_change(seed: int, change: Change, number: int) -> tuple[Watched, float]:
    at_s = float(np.random.default_rng([seed, number]).uniform(FIRST_S, LAST_S))
    return play(seed, at_s + GIVE_UP_S, change, at_s), at_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=20, help="healthy rigs")
    parser.add_argument("--minutes", type=float, default=6.0, help="of each healthy rig")
    parser.add_argument("--seeds", type=int, default=8, help="rigs for each change")
    options = parser.parse_args()
    begin = time.monotonic()
    if options.seeds:
        print(*watch_changing(options.seeds), "", sep="\n", flush=True)
    if options.rigs:
        print(*watch_healthy(options.rigs, options.minutes), "", sep="\n", flush=True)
    print(f"{time.monotonic() - begin:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()

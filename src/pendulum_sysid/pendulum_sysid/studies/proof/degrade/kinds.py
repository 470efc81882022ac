"""The kinds of degradation: what each does to a recording that was good.

Each is a pure function of a recording and a source of chance. Times are stamps from the first
sample, s. `base` names the recording that the kind is made of, see `bases`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pendulum_sysid.reading.raw import STATE_CHANNELS, RawRecording
from pendulum_sysid.studies.proof.degrade.bases import CLOSED, FAST, PLAN, SLOW
from pendulum_twin.arrays import Floats, Mask

Degrade = Callable[[RawRecording, np.random.Generator], RawRecording]


@dataclass(frozen=True)
class Degradation:
    """Hold one kind of degradation.

    name: of the kind.
    says: what happened to the recording, in words.
    degrade: makes the degraded recording.
    base: recording that it is made of.
    reported: kinds of data quality of which at least one has to be reported; empty where the
        recording is only poor, not faulty.
    """

    name: str
    says: str
    degrade: Degrade
    base: str = PLAN
    reported: tuple[str, ...] = ()


def keep_states(raw: RawRecording, kept: Mask) -> RawRecording:
    """Return the recording with the kept samples (n,) alone, on its own clock.

    Raises UnusableRecording where hardly any is kept.
    """
    columns = {
        channel: values[kept]
        for channel in STATE_CHANNELS
        if (values := getattr(raw, channel)) is not None
    }
    stamps = raw.state_stamp_s[kept]
    begin_s = stamps[0] if len(stamps) else 0.0
    return replace(
        raw,
        state_stamp_s=stamps - begin_s,
        command_stamp_s=raw.command_stamp_s - begin_s,
        **columns,
    )


def keep_commands(raw: RawRecording, kept: Mask) -> RawRecording:
    """Return the recording with the kept commands (m,) alone."""
    return replace(raw, command_stamp_s=raw.command_stamp_s[kept], command=raw.command[kept])


def change_positions(raw: RawRecording, change: Callable[[Floats], Floats]) -> RawRecording:
    """Return the recording with every position column (n,) changed."""
    return _set_columns(raw, {joint: change(v) for joint, v in raw.positions.items()})


def _set_columns(raw: RawRecording, columns: dict[str, Floats]) -> RawRecording:
    """Return the recording with other columns (channel -> (n,))."""
    changed: dict[str, Any] = dict(columns)
    return replace(raw, **changed)


def lose(raw: RawRecording, random: np.random.Generator, share: float) -> RawRecording:
    """Lose a share of the messages of both topics, one by one."""
    raw = keep_commands(raw, random.random(len(raw.command)) >= share)
    return keep_states(raw, random.random(len(raw.state_stamp_s)) >= share)


def lose_bursts(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Lose 20 bursts of 0.1 to 0.5 s of both topics."""
    begins = np.sort(random.uniform(0.0, raw.state_stamp_s[-1], 20))
    ends = begins + random.uniform(0.1, 0.5, 20)

    def is_outside(stamps: Floats) -> Mask:
        return ~np.any((stamps[:, None] >= begins) & (stamps[:, None] < ends), axis=1)

    raw = keep_commands(raw, is_outside(raw.command_stamp_s))
    return keep_states(raw, is_outside(raw.state_stamp_s))


def shake_stamps(
    raw: RawRecording, random: np.random.Generator, deviation_s: float
) -> RawRecording:
    """Stamp the samples wrongly, each by its own error; their order stays."""
    off = random.normal(0.0, deviation_s, len(raw.state_stamp_s))
    return replace(raw, state_stamp_s=np.sort(raw.state_stamp_s + off))


def record_twice(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Record one message in twenty of both topics twice."""
    rows, commands = (
        np.sort(np.concatenate([np.arange(n), random.choice(n, n // 20, replace=False)]))
        for n in (len(raw.state_stamp_s), len(raw.command))
    )
    raw = replace(
        raw, command_stamp_s=raw.command_stamp_s[commands], command=raw.command[commands]
    )
    return keep_states(raw, rows)  # an index serves as well as a mask


def set_arrival_stamps(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Stamp samples when they arrive: 1 ms late, 3 ms more by chance, and 30 times a burst."""
    stamps = raw.state_stamp_s + 0.001 + random.exponential(0.003, len(raw.state_stamp_s))
    for begin_s in random.uniform(0.0, stamps[-1], 30):
        inside = (stamps >= begin_s) & (stamps < begin_s + 0.05)
        stamps[inside] = begin_s + 0.05 + 1e-4 * np.arange(np.count_nonzero(inside))
    return replace(raw, state_stamp_s=np.maximum.accumulate(stamps))


def delay_commands(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Log each command up to 10 ms after it acted."""
    late = raw.command_stamp_s + random.uniform(0.0, 0.01, len(raw.command))
    order = np.argsort(late)
    return replace(raw, command_stamp_s=late[order], command=raw.command[order])


def leave_hole(raw: RawRecording, random: np.random.Generator, topic: str) -> RawRecording:
    """Lose 3 s of one topic's messages while the rig moves."""
    begin_s = random.uniform(0.2, 0.7) * raw.state_stamp_s[-1]
    if topic == "command":
        at = raw.command_stamp_s
        return keep_commands(raw, (at < begin_s) | (at > begin_s + 3.0))
    at = raw.state_stamp_s
    return keep_states(raw, (at < begin_s) | (at > begin_s + 3.0))


def end_commands(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Lose the commands of the last 40 %."""
    return keep_commands(raw, raw.command_stamp_s < 0.6 * raw.state_stamp_s[-1])


def add_outliers(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Throw 60 single positions far out."""
    sizes = {"cart": 0.05, "pole": 1.0}
    columns = {}
    for joint, values in raw.positions.items():
        columns[joint] = values.copy()
        at = random.choice(len(values), 60, replace=False)
        columns[joint][at] += sizes[joint] * random.choice([-1.0, 1.0], 60)
    return _set_columns(raw, columns)


def round_positions(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Round positions to ten times the step of the encoder, cart 0.5 mm and pole 1/410 turn."""
    steps = {"cart": 5e-4, "pole": 2 * np.pi / 410}
    columns = {j: steps[j] * np.rint(v / steps[j]) for j, v in raw.positions.items()}
    return _set_columns(raw, columns)


def sample_slowly(raw: RawRecording, random: np.random.Generator, every: int) -> RawRecording:
    """Keep each so many-th sample; commands stay as they are."""
    return keep_states(raw, np.arange(len(raw.state_stamp_s)) % every == 0)


def keep_all(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Change nothing: the base itself is the poor recording."""
    return raw


def cut_short(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Keep the first 10 s: from a later start on, a drift or a phase would be another."""
    return _cut(raw, raw.state_stamp_s[0], raw.state_stamp_s[0] + 10.0)


def keep_upright(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Keep the samples at which the pole is within 0.35 rad of upright."""
    assert raw.pole is not None
    off = np.abs(np.remainder(raw.pole + np.pi, 2 * np.pi) - np.pi)
    return keep_states(raw, off < 0.35)


def clip(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Let the pole's sensor end at a third of a turn from hanging."""
    assert raw.pole is not None
    limit = 2 * np.pi / 3 * random.uniform(0.25, 0.5)
    return replace(raw, pole=np.clip(raw.pole, np.pi - limit, np.pi + limit))


def wrap(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Wrap the angle to half a turn either way."""
    assert raw.pole is not None
    return replace(raw, pole=np.remainder(raw.pole + np.pi, 2 * np.pi) - np.pi)


def smooth(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Average each position over 11 samples, 5 of them in the future."""

    def average(values: Floats) -> Floats:
        padded = np.pad(values, 5, mode="edge")
        return np.convolve(padded, np.full(11, 1 / 11), mode="valid")

    return change_positions(raw, average)


def freeze_stretches(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Let the driver repeat one sample for 1 s, at three times."""
    begins = random.uniform(0.1, 0.9, 3) * raw.state_stamp_s[-1]
    rows = np.arange(len(raw.state_stamp_s))
    for begin_s in begins:
        inside = (raw.state_stamp_s >= begin_s) & (raw.state_stamp_s < begin_s + 1.0)
        rows[inside] = rows[np.argmax(inside)]
    columns = {
        channel: values[rows]
        for channel in STATE_CHANNELS
        if (values := getattr(raw, channel)) is not None
    }
    return replace(raw, **columns)


def add_slips(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Let the cart's belt slip by 4 cm within 0.2 s, at two times."""
    assert raw.cart is not None
    cart = raw.cart.copy()
    for begin_s in random.uniform(0.1, 0.9, 2) * raw.state_stamp_s[-1]:
        cart += 0.04 * np.clip((raw.state_stamp_s - begin_s) / 0.2, 0.0, 1.0)
    return replace(raw, cart=cart)


def _cut(raw: RawRecording, begin_s: float, end_s: float) -> RawRecording:
    raw = keep_commands(raw, (raw.command_stamp_s >= begin_s) & (raw.command_stamp_s < end_s))
    return keep_states(raw, (raw.state_stamp_s >= begin_s) & (raw.state_stamp_s < end_s))


DEGRADATIONS = (
    Degradation(
        "loss_1", "1 % of the messages lost", partial(lose, share=0.01), reported=("gap",)
    ),
    Degradation(
        "loss_20", "20 % of the messages lost", partial(lose, share=0.2), reported=("gap",)
    ),
    Degradation("loss_bursts", "20 bursts of 0.1 to 0.5 s lost", lose_bursts, reported=("gap",)),
    Degradation("jitter_1", "stamps off by 1 ms", partial(shake_stamps, deviation_s=0.001)),
    Degradation(
        "jitter_3",
        "stamps off by 3 ms",
        partial(shake_stamps, deviation_s=0.003),
        reported=("jitter",),
    ),
    Degradation(
        "jitter_10",
        "stamps off by 10 ms",
        partial(shake_stamps, deviation_s=0.01),
        reported=("jitter",),
    ),
    Degradation("duplicates", "5 % of the messages twice", record_twice, reported=("stale",)),
    Degradation(
        "arrival", "stamps of the arrival, bursts", set_arrival_stamps, reported=("jitter",)
    ),
    Degradation("late_commands", "commands logged up to 10 ms late", delay_commands),
    Degradation(
        "command_hole",
        "3 s of commands lost",
        partial(leave_hole, topic="command"),
        reported=("gap",),
    ),
    Degradation("commands_end", "commands end at 60 %", end_commands, reported=("gap",)),
    Degradation(
        "state_hole", "3 s of samples lost", partial(leave_hole, topic="state"), reported=("gap",)
    ),
    Degradation("outliers", "60 spikes a sensor", add_outliers, reported=("spike",)),
    Degradation("coarse", "encoder steps ten times larger", round_positions),
    Degradation("rate_20", "sampled at 20 Hz", partial(sample_slowly, every=5)),
    Degradation("rate_10000", "sampled at 10 kHz", keep_all, base=FAST),
    Degradation("short", "10 s only", cut_short),
    Degradation("slow", "slow motion only", keep_all, base=SLOW),
    Degradation("upright", "near upright in closed loop only", keep_upright, base=CLOSED),
    Degradation("clipped", "the pole's sensor ends", clip, reported=("clipped",)),
    Degradation("wrapped", "angles wrapped", wrap, reported=("wrap",)),
    Degradation("smoothed", "positions averaged over 0.11 s", smooth, reported=("refused",)),
    Degradation(
        "stale", "1 s of samples repeated, three times", freeze_stretches, reported=("stale",)
    ),
    Degradation(
        "slipped", "the cart's belt slips 4 cm, twice", add_slips, reported=("gap", "slip")
    ),
)
BY_NAME = {degradation.name: degradation for degradation in DEGRADATIONS}

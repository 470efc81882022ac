"""Find commands that a recording holds late: a sample or more after they began to act.

A log that writes down the last command beside new positions holds every command a sample late. A
twin cannot answer a command before it comes, so that other physics takes the blame. With commands
at the right samples the same twin fits many times better, and worse again a sample further. A twin
that is wrong otherwise may gain by earlier commands, too, but little by each sample.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.records import FaultKind, QualityFinding, Recording, Split
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.signals import Signals

LATE: FaultKind = "late_command"
BY_A_ROW = (
    "Does a row of the file hold the command before its positions? Import the file with "
    "--command-acts before, or record commands as they are sent"
)
BY_STAMPS = "Do commands and positions have stamps of one clock? Record commands as they are sent"
MOST_SAMPLES = 10  # time; `check_causality` refuses a recording whose commands are far later


def move_late_commands(case: Case, split: Split, effects: tuple[str, ...], theta: Floats) -> Case:
    """Return the case with commands where they began to act; the case itself if they stand there.

    The misfit over the samples by which commands are moved has to have a sharp minimum.

    effects, theta: of a twin to fit, (SIZE,).
    """
    if not (case.twin.rig.has_cart and np.any(case.signals.command)):
        return case
    moved, misfits = [case], [fit(case, split, effects, theta, HORIZONS[0]).choose]
    if misfits[0] <= decisions.MISFIT_AT_NOISE:
        return case
    while len(moved) <= MOST_SAMPLES and misfits[-1] == min(misfits):
        moved.append(replace(case, recording=_move_commands_of(case.recording, len(moved))))
        misfits.append(fit(moved[-1], split, effects, theta, HORIZONS[0]).choose)
    late = len(moved) - 2
    beside = min(misfits[late - 1], misfits[late + 1])
    if late < 1 or misfits[late] * decisions.FAULT_SURE_RATIO >= beside:
        return case
    gain = misfits[0] / misfits[late]
    return replace(moved[late], recording=_say_how_late(moved[late].recording, late, gain))


def move_commands(signals: Signals, samples: int) -> Signals:
    """Return signals with every command so many samples earlier, the last of a stretch kept.

    No sample of a stretch shows what its last commands do.
    """
    source = _list_sources(signals, samples)
    parts = None if signals.parts is None else signals.parts[source]
    return replace(signals, command=signals.command[source], parts=parts)


def _move_commands_of(recording: Recording, samples: int) -> Recording:
    moved, doubt = move_commands(recording.signals, samples), recording.doubt
    if doubt is not None:
        source = _list_sources(recording.signals, samples)
        doubt = _move_doubt(doubt, source, samples)
    return replace(recording, signals=moved, doubt=doubt, at_once=None)


def _list_sources(signals: Signals, samples: int) -> Ints:
    """Return from which sample each sample gets its command, (n,)."""
    source = np.arange(len(signals)) + samples
    for stretch in signals.stretches:
        part = source[stretch.start : stretch.stop]
        np.minimum(part, stretch.stop - 1, out=part)
    return source


def _move_doubt(doubt: CommandDoubt, source: Ints, samples: int) -> CommandDoubt | None:
    """Return the doubt at the samples to which its commands go; None where none is left."""
    at = doubt.samples - samples
    kept = (at >= 0) & (source[np.maximum(at, 0)] == doubt.samples)
    if not kept.any():
        return None
    return CommandDoubt(at[kept], doubt.values[kept], doubt.costs[kept], doubt.chosen[kept])


def _say_how_late(recording: Recording, samples: int, gain: float) -> Recording:
    """Return the recording with the finding that its commands were moved, and what to do."""
    milliseconds = samples * recording.signals.period_s * 1e3
    how_long, remedy = (
        ("1 sample", BY_A_ROW) if samples == 1 else (f"{samples} samples", BY_STAMPS)
    )
    note = (
        f"every command stood {how_long} ({milliseconds:.3g} ms) after it began to act, and was "
        f"moved back: the twin then fits {gain:.3g} times better. {remedy}"
    )
    return replace(
        recording, findings=(*recording.findings, QualityFinding(LATE, samples, (), note))
    )

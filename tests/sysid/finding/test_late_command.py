"""Commands that a recording holds late are moved back, and nothing else takes the blame."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_sysid.finding import late_command
from pendulum_sysid.finding.late_command import LATE, move_late_commands
from pendulum_sysid.finding.settled_search import search_settled
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_twin.parameter_vector import make_theta

SECONDS = 20.0


def delay_log(recording: Recording, samples: int) -> Recording:
    """Return a recording whose every row holds the command of so many rows before."""
    command = recording.signals.command
    late = np.concatenate([np.zeros(samples), command[: len(command) - samples]])
    return replace(recording, signals=replace(recording.signals, command=late))


def move(recording: Recording) -> Recording:
    """Return the recording as the constants alone settle it."""
    prepared = prepare([recording], INTECO)
    case, split = prepared.case, prepared.split
    return move_late_commands(case, split, (), make_theta(INTECO)).recording


@pytest.mark.parametrize("samples", [1, 2])
def test_late_commands_go_back_to_where_they_began_to_act(samples: int) -> None:
    recording, _ = record_hidden({}, 1, SECONDS)
    moved = move(delay_log(recording, samples))
    command = recording.signals.command
    assert np.array_equal(moved.signals.command[:-samples], command[:-samples])
    (late,) = moved.findings
    assert (late.kind, late.count) == (LATE, samples)
    assert f"({10 * samples} ms)" in late.note
    assert ("--command-acts before" in late.note) == (samples == 1)


@pytest.mark.parametrize("name", ["input_delay", "motor_lag", "stretching_belt", "angle_delay"])
def test_a_drive_that_answers_late_moves_no_command(name: str) -> None:
    recording, _ = record_hidden({name: HIDDEN[name]}, 1, SECONDS)
    assert move(recording).findings == ()


@pytest.mark.parametrize(
    ("misfits", "moves"),
    [
        ((9.95, 0.94, 10.4), 1),
        ((58.8, 34.9, 12.8, 0.95, 13.0), 3),  # stamps 30 ms late
        ((389.4, 360.2, 323.7, 277.7, 208.0, 100.1, 85.6, 103.3), 0),  # INTECO, a sign wrong
        ((1.05, 0.6, 1.05), 0),  # at the noise
    ],
)
def test_a_sharp_minimum_says_how_late_commands_are(
    misfits: tuple[float, ...], moves: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A twin that is wrong otherwise gains by earlier commands, but little by each sample."""
    prepared = prepare([record_hidden({}, 1, SECONDS)[0]], INTECO)
    left = iter(misfits)
    monkeypatch.setattr(late_command, "fit", lambda *_: SimpleNamespace(choose=next(left)))
    moved = move_late_commands(prepared.case, prepared.split, (), make_theta(INTECO)).recording
    assert [fault.count for fault in moved.findings] == ([moves] if moves else [])


@pytest.mark.long
def test_beside_other_physics_late_commands_are_seen_when_it_has_a_name() -> None:
    """The constants alone fit as badly with the commands either way."""
    recording, _ = record_hidden({"input_dead_zone": {"width": 0.04}}, 1, SECONDS)
    prepared = prepare([delay_log(recording, 1)], INTECO)
    case, _, answer = search_settled(prepared.case, prepared.split)
    assert [(f.kind, f.count) for f in case.recording.findings] == [(LATE, 1)]
    assert answer.best.effects == ("input_dead_zone",)


def test_doubtful_commands_move_along_and_none_leaves_its_stretch() -> None:
    recording, _ = record_hidden({}, 1, SECONDS)
    late = delay_log(recording, 1)
    signals = replace(late.signals, stretch_begins=(0, 1000))
    at = np.array([0, 500, 1000])
    values = np.column_stack([signals.command[at], signals.command[at]])
    doubt = CommandDoubt(at, values, np.tile([0.0, 1e3], (3, 1)), np.zeros(3, dtype=np.int64))
    moved = move(replace(late, signals=signals, doubt=doubt))
    assert moved.doubt is not None and moved.doubt.samples.tolist() == [499]
    assert moved.signals.command[999] == signals.command[999]
    assert moved.signals.command[998] == signals.command[999]

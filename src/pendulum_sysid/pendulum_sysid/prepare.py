"""The one way in: recordings and a twin become a case whose motion is smoothed once.

Recordings are cleaned where they are read (`reading`, `cleaning.clean`). Here each loses the start
that does not belong to it; then they are joined, and a joint that never moved is left out. The
smoothed motion is computed once and handed on. It is computed again only where the samples have
changed: the length of the smoothing polynomials is chosen over all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pendulum_sysid.cleaning.causality import check_causality
from pendulum_sysid.cleaning.command_answer import check_follows_command
from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.cleaning.moving_joints import leave_out_still_cart
from pendulum_sysid.cleaning.rail_ends import leave_out_rail_ends
from pendulum_sysid.cleaning.slips import leave_out_slips
from pendulum_sysid.cleaning.smooth_state import SmoothState, smooth_state
from pendulum_sysid.cleaning.stale_start import leave_out_stale_start
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.plausibility.ask import list_plausibility_doubts
from pendulum_sysid.records import QualityFinding, Recording, Split
from pendulum_twin.model import Twin


@dataclass(frozen=True)
class Prepared:
    """Hold recordings that can answer the question, as a case and its windows.

    case: the recordings as one, smoothed, and the twin without the joints that they lack.
    split: windows to fit and to choose on, by cross-validation, and windows to judge on.
    doubts: sentences of the checks that leave in doubt whether the recordings are the rig's.
    """

    case: Case
    split: Split
    doubts: tuple[str, ...] = ()

    @property
    def findings(self) -> tuple[QualityFinding, ...]:
        """Return the faults in the data that the cleaning met."""
        return self.case.recording.findings


def prepare(recordings: Sequence[Recording], twin: Twin) -> Prepared:
    """Prepare recordings of one rig for a diagnosis or a fit.

    recordings: cleaned, at least one.
    twin: the twin to start from.

    Raises WrongUse when the recordings do not fit together or hold a joint that the twin lacks,
    and UnusableRecording when the recordings cannot be the rig's, nothing moves, too few samples
    are valid or the cart does not follow the command.
    """
    case = prepare_case(recordings, twin)
    doubts = list_plausibility_doubts(case)
    return replace(prepare_windows(case), doubts=doubts)


def prepare_windows(case: Case) -> Prepared:
    """Prepare a case for a diagnosis or a fit: its joints move, and its samples suffice.

    Raises UnusableRecording as `prepare` does, but for recordings that cannot be the rig's.
    """
    try:
        case = _leave_out_still_cart(case)
        windows = split_windows(case.signals, case.state)
        check_follows_command(case.signals, case.state)
        check_causality(case.signals, case.state)
    except UnusableRecording as error:
        raise UnusableRecording(str(error), case.recording) from error
    return Prepared(case, windows)


def prepare_case(recordings: Sequence[Recording], twin: Twin) -> Case:
    """Prepare recordings of one rig to be replayed; a rig that never moves is no error here.

    Raises WrongUse as `prepare` does.
    """
    half_m = twin.rig.rail_half_length_m
    smoothed = [_smooth_own_run(recording, half_m) for recording in recordings]
    recording, state = smoothed[0]
    if len(smoothed) > 1:
        recording = join_recordings([own for own, _ in smoothed])
        state = smooth_state(recording.signals)
    return make_case(recording, state, twin)


def _smooth_own_run(recording: Recording, half_m: float | None) -> tuple[Recording, SmoothState]:
    """Return a recording without what is not the rig's own run, and its smooth motion.

    Left out are a start that belongs to another run, slips of the cart's reading, and where the
    cart stands at an end of the rail, half_m from its middle.
    """
    recording = leave_out_rail_ends(recording, half_m)
    state = smooth_state(recording.signals)
    for leave_out in (leave_out_stale_start, leave_out_slips):
        own = leave_out(recording, state)
        if own is not recording:
            recording, state = own, smooth_state(own.signals)
    return recording, state


def _leave_out_still_cart(case: Case) -> Case:
    """Return the case without its cart if the cart neither moved nor was told to move."""
    recording = leave_out_still_cart(case.recording, case.state)
    if recording is case.recording:
        return case
    state = smooth_state(recording.signals)
    return make_case(recording, state, case.twin)

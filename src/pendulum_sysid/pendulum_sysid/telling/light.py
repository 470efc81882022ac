"""The traffic light of a verdict: whether the improved twin may be used, and why not."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid import decisions
from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.display import format_intervals, format_percent, render_number
from pendulum_sysid.telling.error_scale import get_floors
from pendulum_sysid.verdict.record import Verdict

RED, AMBER, BLUE = "red", "amber", "blue"
TITLES = {
    RED: "Do not use this twin",
    AMBER: "Use this twin with care",
    BLUE: "The improved twin is good for use",
}
# Faults that take stretches of time away.
LOST_KINDS = ("gap", "stale", "clipped", "slip", "rail_end")


@dataclass(frozen=True)
class Light:
    """Hold the colour of the light, its title and the reasons for it, a clause each."""

    colour: str
    title: str
    reasons: tuple[str, ...]


def judge_light(verdict: Verdict) -> Light:
    """Return the light: red for what must not be used, amber for doubts, blue for neither."""
    stops = list_stops(verdict)
    if stops:
        return Light(RED, TITLES[RED], stops)
    doubts = list_doubts(verdict)
    if doubts:
        return Light(AMBER, TITLES[AMBER], doubts)
    return Light(BLUE, TITLES[BLUE], ("little remains, and the data have few gaps",))


def list_stops(verdict: Verdict) -> tuple[str, ...]:
    """Return why the improved twin must not be used; nothing where it may be."""
    if verdict.outcome is Outcome.UNUSABLE:
        return ("the recording cannot answer the question",)
    if verdict.unlike_rig:
        return ("the recording does not look like this rig",)
    return ()


def list_doubts(verdict: Verdict) -> tuple[str, ...]:
    """Return what speaks against using the improved twin as it is, a clause each."""
    doubts = []
    rest = verdict.remainder
    floors = [rest.above_noise_floor] if rest else []
    floors += [get_floors(verdict.fit).after] if verdict.fit else []
    if max(floors, default=0.0) > decisions.LITTLE_MOST_FLOORS:
        ratio = render_number(max(floors))
        doubts.append(f"the improved twin's error is {ratio} times the noise floor")
    elif rest and rest.whole_windows and rest.whole_windows > decisions.LITTLE_MOST_FLOORS:
        ratio = render_number(rest.whole_windows)
        doubts.append(f"over whole windows the twin errs by {ratio} times the sensors' noise")
    if verdict.events_s:
        doubts.append(f"something acted on the rig at {format_intervals(verdict.events_s)}")
    elif verdict.rig_changed:
        doubts.append("the rig changed between the recordings")
    elif verdict.outcome is Outcome.NOT_IN_CATALOGUE:
        doubts.append("something is missing that has no name")
    if verdict.outcome is Outcome.AMBIGUOUS:
        doubts.append("more than one effect explains the recording")
    lost = compute_lost_share(verdict)
    if lost > decisions.LIGHT_MOST_LOST:
        doubts.append(f"gaps and faults take {format_percent(lost)} of the recording")
    gaps = sum(fault.count for fault in verdict.data_quality if fault.kind == "gap")
    most = decisions.LIGHT_MOST_GAPS_A_MINUTE * max(verdict.recording.seconds, 1.0) / 60.0
    if gaps > most:
        doubts.append(f"the recording has {gaps} gaps")
    doubts += ["a constant, a unit or a time as given is contradicted"] * bool(verdict.warnings)
    return tuple(doubts)


def compute_lost_share(verdict: Verdict) -> float:
    """Return the share of time, 0 to 1, in which faults took samples away.

    The time goes from the first sample to the end of the recording, pauses included. A moment in
    which two faults took samples away counts once.
    """
    lost = sorted(
        interval
        for fault in verdict.data_quality
        if fault.kind in LOST_KINDS
        for interval in fault.intervals_s
    )
    end_s = max([verdict.recording.seconds, *(end for _, end in lost)])
    if verdict.drawings is not None and len(verdict.drawings.motion.times_s):
        end_s = max(end_s, float(verdict.drawings.motion.times_s[-1]))
    lost_s = reached_s = 0.0
    for begin, end in lost:
        lost_s += max(end - max(begin, reached_s), 0.0)
        reached_s = max(reached_s, end)
    return min(lost_s / max(end_s, 1e-9), 1.0)

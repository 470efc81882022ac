"""What to play next on a rig: the plan that parts tied effects best, or narrows intervals.

For tied twins: the plan whose recording leaves most of their difference after each has followed
the other as far as its parameters allow (T-optimal: Atkinson and Fedorov, Biometrika 62 (1975)
57). For intervals, and the bands of measured laws: the plan that adds most information about the
worst-known of them to the recordings at hand (Goodwin and Payne, Dynamic System Identification
(1977), chapter 6).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from pendulum_sysid import decisions
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.finding.separation import Tie, compute_naming_threshold
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.planning.aims import Aim, Narrowing, Parting, list_narrowings, make_partings
from pendulum_sysid.planning.growing_plan import SHORTEST_S, GrownPlan, grow_plan
from pendulum_sysid.planning.law_aims import list_band_narrowings
from pendulum_sysid.planning.next_sentences import (
    LOCKED,
    NO_LAW,
    NO_ROOM,
    NOTHING_TIED,
    describe_hopeless,
    describe_narrowing,
    describe_never_parted,
    describe_nothing_to_ask,
    describe_partings,
    describe_unfixed,
)
from pendulum_sysid.records import Fit, Next, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.waveforms import make_envelope

SECONDS = 20.0
CHANGED = Next(
    None,
    "The rig changed between the recordings, and no plan narrows what is not the same in all: "
    "diagnose each recording by itself.",
)


def plan_next_experiment(
    case: Case,
    split: Split,
    best: Fit,
    ties: Sequence[Tie],
    goal: str | None = None,
    seconds: float = SECONDS,
    bands: Mapping[str, Floats] | None = None,
) -> Next:
    """Return the next experiment after a diagnosis.

    best: the fit that the diagnosis ended with.
    ties: effects that it could not part, see `identifiability.find_ties`.
    goal: "tie", "interval", "law", or None for what is tied, or else for wide intervals and bands.
    seconds: length of the plan.
    bands: measured law of the fit -> (knots,) half widths of its band, in the unit of its values.

    Raises WrongUse for a plan too short for a push, a phase and a rest.
    """
    check_seconds(seconds)
    never = [describe_never_parted(tie) for tie in ties if tie.by_no_motion]
    tied = _list_partings(case, split, best, ties) if goal in (None, "tie") else []
    parting = _plan_for(case, best, tied, seconds, never) if tied else Next(None, " ".join(never))
    if parting.plan is not None or goal == "tie":
        return parting if parting.why else Next(None, NOTHING_TIED)
    wide = _list_wide(case, split, best, bands or {}, goal)
    if wide:
        said = [parting.why] if parting.why else []
        narrowing = _plan_for(case, best, wide, seconds, said)
        return parting if tied and narrowing.plan is None else narrowing
    if goal == "law":
        return Next(None, NO_LAW)
    return Next(None, parting.why if tied else " ".join([*never, describe_nothing_to_ask(best)]))


def check_seconds(seconds: float) -> None:
    """Raise WrongUse for a plan of fewer s than a push, a phase and a rest take."""
    if not seconds >= SHORTEST_S:
        raise WrongUse(
            f"seconds: expected at least {SHORTEST_S:g}, found {seconds:g}: ask for more"
        )


def _plan_for(
    case: Case, best: Fit, aims: Sequence[Aim], seconds: float, said: Sequence[str]
) -> Next:
    """Return the plan for the aims, without the ties that no plan of this length parts.

    said: sentences that follow those on the plan.
    """
    if case.signals.cart is None:
        return Next(None, " ".join([LOCKED, *said]))
    try:
        grown = grow_plan(case, best, aims, make_envelope(case.twin.rig), seconds)
    except BadInputError as error:  # no known rail, or a rate that no plan may have
        return Next(None, " ".join([f"No plan can be made: {error}.", *said]))
    if grown is None:
        return Next(None, " ".join([NO_ROOM, *said]))
    values = len(case.signals) * len(case.noise) + grown.values
    needed = compute_naming_threshold(int(decisions.DECIDING_SHARE * values))
    ratings = [aim.rate(normal) for aim, normal in zip(aims, grown.normals, strict=True)]
    hopeless = {
        aim.subject
        for aim, rating in zip(aims, ratings, strict=True)
        if isinstance(aim, Parting) and rating < decisions.APART_STANDARD_ERRORS
    }
    unfixed = {
        aim.subject
        for aim, normal in zip(aims, grown.normals, strict=True)
        if isinstance(aim, Narrowing) and not math.isfinite(aim.predict_half_width(normal))
    }
    if not hopeless and not unfixed:
        return _explain_plan(aims, grown, ratings, said, needed)
    said = [*said, *(describe_hopeless(s, aims, ratings, seconds) for s in sorted(hopeless))]
    said += [describe_unfixed(subject, seconds) for subject in sorted(unfixed)]
    others = [aim for aim in aims if aim.subject not in hopeless | unfixed]
    if not others:
        return Next(None, " ".join(said))
    return _plan_for(case, best, others, seconds, said)


def _list_partings(case: Case, split: Split, best: Fit, ties: Sequence[Tie]) -> list[Aim]:
    """Return both directions of the closest ties that motion can part."""
    closest = sorted(
        (tie for tie in ties if tie.rival and not tie.by_no_motion), key=lambda tie: tie.distance
    )
    return [
        aim
        for tie in closest[: decisions.MOST_PLANNED_FOR]
        for aim in make_partings(case, split, best, tie)
    ]


def _list_wide(
    case: Case, split: Split, best: Fit, bands: Mapping[str, Floats], goal: str | None
) -> list[Narrowing]:
    """Return the intervals and bands that are wider than a share of their value, widest first.

    With a goal: the widest of them.
    """
    aims = [] if goal == "law" else list_narrowings(case, split, best)
    if goal != "interval":
        aims += list_band_narrowings(case, split, best, bands)
    at_least, most = (0.0, 1) if goal else (decisions.WIDE_INTERVAL, decisions.MOST_PLANNED_FOR)
    wide = [aim for aim in aims if aim.half > at_least * aim.scale]
    return sorted(wide, key=lambda aim: aim.half / aim.scale, reverse=True)[:most]


def _explain_plan(
    aims: Sequence[Aim],
    grown: GrownPlan,
    ratings: Sequence[float],
    said: Sequence[str],
    needed: float,
) -> Next:
    """Return the plan with a sentence an aim; its figures are those of the worst-served aim."""
    worst = min(range(len(aims)), key=lambda k: ratings[k])
    aim = aims[worst]
    if isinstance(aim, Narrowing):
        before, after = aim.half, aim.predict_half_width(grown.normals[worst])
        sentences = [
            describe_narrowing(narrowing, normal)
            for narrowing, normal in zip(aims, grown.normals, strict=True)
            if isinstance(narrowing, Narrowing)
        ]
    else:
        before, after = aim.rate(aim.normal), ratings[worst]
        sentences = describe_partings(aims, ratings, needed)
    return Next(grown.plan.to_mapping(), " ".join([*sentences, *said]), before, after)

"""What to play next on a rig: the plan that best parts what is still tied, or narrows what is known only widely.

For tied twins, the plan whose recording would leave most of their difference after each has done
all that it can to look like the other (T-optimal: Atkinson and Fedorov, Biometrika 62 (1975) 57);
for intervals, the one that adds most information about the worst-known parameter to what is at
hand (Goodwin and Payne, Dynamic System Identification (1977), chapter 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pendulum_sysid import decisions
from pendulum_sysid.finding.separation import Tie, compute_naming_threshold
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.planning.aims import Aim, Narrowing, Parting, list_narrowings, make_partings
from pendulum_sysid.planning.growing_plan import SHORTEST_S, GrownPlan, grow_plan
from pendulum_sysid.records import Fit, Next, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.waveforms import make_envelope

SECONDS = 20.0
REMEDIES = {  # by the effect that shows as another one: what would part the two
    "sensor_delay": "a second clock would: record the drive's own current beside the positions",
    "pole_imbalance": "a plumb line beside the pole at rest would: an encoder that is off leaves the pole itself plumb",
    "sample_period_error": "a ruler along the cart's stroke would, or a watch beside a long recording",
}
LOCKED = "The cart is locked, so there is no plan to play: let the pole swing from further up, and longer."
NOTHING_TIED = "Nothing that motion could part is tied on this recording."
NO_ROOM = "No phase of a plan keeps the cart on the rail and within safe speeds."


def plan_next_experiment(
    case: Case,
    split: Split,
    best: Fit,
    ties: Sequence[Tie],
    goal: str | None = None,
    seconds: float = SECONDS,
    seed: int = 0,
) -> Next:
    """Return the next experiment after a diagnosis that ended in a fit and in ties (`identifiability.ties`).

    goal: "tie", "interval", or None for whichever there is. The same inputs and seed give the same
    plan. Raises BadInputError for a plan too short for a push, a phase and a rest.
    """
    if not seconds >= SHORTEST_S:
        raise BadInputError(f"seconds: expected at least {SHORTEST_S:g}, found {seconds:g}")
    never = [_describe_never_parted(tie) for tie in ties if tie.by_no_motion]
    tied = [] if goal == "interval" else _list_partings(case, split, best, ties)
    found = (
        _plan_for(case, best, tied, seconds, seed, never) if tied else Next(None, " ".join(never))
    )
    if found.plan is not None or goal == "tie":
        return found if found.why else Next(None, NOTHING_TIED)
    wide = list_narrowings(case, split, best, 0.0 if goal else decisions.WIDE_INTERVAL)[
        : 1 if goal else decisions.INTERVALS_PLANNED_FOR
    ]
    if wide:
        more = _plan_for(case, best, wide, seconds, seed, [found.why] if found.why else [])
        return found if tied and more.plan is None else more
    return Next(None, found.why if tied else " ".join([*never, _describe_nothing_to_ask(best)]))


def _plan_for(
    case: Case, best: Fit, aims: Sequence[Aim], seconds: float, seed: int, never: Sequence[str]
) -> Next:
    """Return the plan for these aims; ties that it would leave as they are do not hold up the others."""
    if case.signals.cart is None:
        return Next(None, " ".join([LOCKED, *never]))
    try:
        found = grow_plan(case, best, aims, make_envelope(case.twin.rig), seconds, seed)
    except (
        BadInputError
    ) as error:  # the rail is not known, or the rig's rate is none that a plan may have
        return Next(None, " ".join([f"No plan can be made: {error}.", *never]))
    if found is None:
        return Next(None, " ".join([NO_ROOM, *never]))
    needed = compute_naming_threshold(
        int(decisions.DECIDING_SHARE * (len(case.signals) * len(case.noise) + found.values))
    )
    worths = [aim.worth(one) for aim, one in zip(aims, found.products, strict=True)]
    hopeless = {
        aim.said
        for aim, worth in zip(aims, worths, strict=True)
        if isinstance(aim, Parting) and worth < decisions.APART_STANDARD_ERRORS
    }
    if not hopeless:
        return _explain_plan(aims, found, never, needed)
    never = [
        *never,
        *(_describe_hopeless(said, aims, worths, seconds) for said in sorted(hopeless)),
    ]
    others = [aim for aim in aims if aim.said not in hopeless]
    return (
        _plan_for(case, best, others, seconds, seed, never)
        if others
        else Next(None, " ".join(never))
    )


def _describe_hopeless(
    said: str, aims: Sequence[Aim], worths: Sequence[float], seconds: float
) -> str:
    then = min(worth for aim, worth in zip(aims, worths, strict=True) if aim.said == said)
    return (
        f"No plan of {seconds:g} s that the rig allows is expected to part {said} ({then:.2g} standard errors between them "
        f"at best, {decisions.APART_STANDARD_ERRORS:g} at least are needed): a longer one might, or no motion does, and only a measurement by hand."
    )


def _list_partings(case: Case, split: Split, best: Fit, ties: Sequence[Tie]) -> list[Aim]:
    """Return both directions of the closest ties that motion can part."""
    closest = sorted(
        (tie for tie in ties if tie.rival and not tie.by_no_motion), key=lambda tie: tie.distance
    )
    return [
        aim
        for tie in closest[: decisions.TIES_PLANNED_FOR]
        for aim in make_partings(case, split, best, tie)
    ]


def _explain_plan(
    aims: Sequence[Aim], found: GrownPlan, never: Sequence[str], needed: float
) -> Next:
    """Return the plan with a sentence on each aim; figures are those of the worst-served one.

    needed: standard errors at which a diagnosis of both recordings will tell two twins apart.
    """
    worths = [aim.worth(one) for aim, one in zip(aims, found.products, strict=True)]
    worst = min(range(len(aims)), key=lambda k: worths[k])
    aim = aims[worst]
    if isinstance(aim, Narrowing):
        before, after = aim.half, aim.expected(found.products[worst])
        said = [
            _describe_narrowing(one, products)
            for one, products in zip(aims, found.products, strict=True)
        ]
    else:
        before, after = aim.worth(aim.normal), worths[worst]
        said = _describe_partings(aims, worths, needed)
    return Next(found.plan.to_mapping(), " ".join([*said, *never]), before, after)


def _describe_partings(aims: Sequence[Aim], worths: Sequence[float], needed: float) -> list[str]:
    """Return one sentence a tie, of whichever direction is the closer."""
    sentences = []
    for said in dict.fromkeys(aim.said for aim in aims):
        now = min(aim.worth(aim.normal) for aim in aims if aim.said == said)
        then = min(worth for aim, worth in zip(aims, worths, strict=True) if aim.said == said)
        enough = "enough" if then >= needed else "still too little, so play it several times"
        sentences.append(
            f"{said} cannot be told apart on this recording ({now:.2g} standard errors between them); with this plan's "
            f"recording {then:.3g} are expected, which is {enough} ({needed:.2g} are needed)."
        )
    return sentences


def _describe_narrowing(aim: Aim, products: Any) -> str:
    assert isinstance(aim, Narrowing)
    unit = aim.free[aim.number].unit
    unit = "" if unit == "1" else unit
    now = (
        "not fixed at all"
        if aim.half == float("inf")
        else f"known to +-{aim.half:.2g} {unit}".strip()
    )
    expected = aim.expected(products)
    little = ", so play it several times" if expected > decisions.INTERVAL_SHARE * aim.half else ""
    return (
        f"{aim.said} is {now}; with this plan's recording +-{expected:.2g} {unit}".strip()
        + f" is expected{little}."
    )


def _describe_never_parted(tie: Tie) -> str:
    remedy = next(
        (REMEDIES[name] for name in (tie.effect, tie.rival) if name in REMEDIES),
        "a second sensor would",
    )
    return f"No motion will part {tie.effect} from {tie.rival}; {remedy}."


def _describe_nothing_to_ask(best: Fit) -> str:
    """Return the sentence for a recording that leaves nothing to ask, with what it fixes."""
    fixed = [
        f"{name} to {max(one.high - one.value, one.value - one.low) / abs(one.value):.2%}"
        for name, one in best.estimates.items()
        if one.identifiable and one.value and not _is_shape(name)
    ]
    all_fixed = ", ".join(fixed)
    return f"Nothing is tied that motion could part, and no interval is wide: this recording fixes {all_fixed} of itself."


def _is_shape(name: str) -> bool:
    effect, _, parameter = name.partition(".")
    return bool(parameter) and next(
        p.shape for p in BY_NAME[effect].parameters if p.name == parameter
    )

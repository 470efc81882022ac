"""The sentences on a next experiment: what a plan parts or narrows, and what no plan does."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid import decisions
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.planning.aims import Aim, Narrowing
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME

LOCKED = (
    "The cart is locked, so there is no plan to play: let the pole swing from further up, and "
    "longer."
)
NOTHING_TIED = "Nothing that motion could part is tied on this recording."
NO_LAW = (
    "There is no measured law that a plan could sharpen: give --verdict of a diagnosis that "
    "measured laws. A law over time is known better from a longer recording."
)
NO_ROOM = "No phase of a plan keeps the cart on the rail and within safe speeds."


def describe_never_parted(tie: Tie) -> str:
    """Return the sentence on a tie that no motion parts."""
    names = (tie.effect, tie.rival)
    remedies = (BY_NAME[name].separated_by for name in names if name)
    remedy = next(filter(None, remedies), "a second sensor would")
    return f"No motion will part {tie.effect} from {tie.rival}; {remedy}."


def describe_hopeless(
    subject: str, aims: Sequence[Aim], ratings: Sequence[float], seconds: float
) -> str:
    """Return the sentence on a tie that no plan of this length parts."""
    then = _find_least(subject, aims, ratings)
    return (
        f"No plan of {seconds:g} s that the rig allows is expected to part {subject} "
        f"({then:.2g} standard errors between them at best, "
        f"{decisions.APART_STANDARD_ERRORS:g} at least are needed): a longer one might, or no "
        "motion does, and only a measurement by hand."
    )


def describe_partings(aims: Sequence[Aim], ratings: Sequence[float], needed: float) -> list[str]:
    """Return a sentence a tie, on the direction in which the two twins are closer.

    ratings: standard errors between the twins of each aim after the plan.
    needed: standard errors from which a diagnosis of all recordings names an effect.
    """
    before = [aim.rate(aim.normal) for aim in aims]
    sentences = []
    for subject in dict.fromkeys(aim.subject for aim in aims):
        now, then = (_find_least(subject, aims, values) for values in (before, ratings))
        enough = "enough" if then >= needed else "still too little, so play it several times"
        sentences.append(
            f"{subject} cannot be told apart on this recording ({now:.2g} standard errors between "
            f"them); with this plan's recording {then:.3g} are expected, which is {enough} "
            f"({needed:.2g} are needed)."
        )
    return sentences


def describe_narrowing(aim: Narrowing, normal: Floats) -> str:
    """Return the sentence on an interval, now and with the normal matrix of all recordings."""
    unit = "" if aim.unit == "1" else aim.unit
    mean = " on average" if len(aim.sums) > 1 else ""
    unfixed = aim.half == float("inf")
    now = "not fixed at all" if unfixed else f"known to +-{aim.half:.2g} {unit}".strip()
    expected = aim.predict_half_width(normal)
    little = ", so play it several times" if expected > decisions.INTERVAL_SHARE * aim.half else ""
    plan = f"{aim.subject} is {now}{mean}; with this plan's recording +-{expected:.2g} {unit}"
    return f"{plan.strip()} is expected{little}."


def describe_unfixed(subject: str, seconds: float) -> str:
    """Return the sentence on an interval that no plan of this length makes finite."""
    return (
        f"{subject} is not fixed at all, and no plan of {seconds:g} s that the rig allows fixes "
        "it: motion shows no more than its ratio to other constants, so measure it by hand."
    )


def describe_nothing_to_ask(best: Fit) -> str:
    """Return the sentence on a recording that leaves nothing to ask, with what it fixes."""
    fixed = [
        f"{name} to {100.0 * max(e.high - e.value, e.value - e.low) / abs(e.value):.2g}%"
        for name, e in best.estimates.items()
        if e.identifiable and e.value and not _is_shape(name)
    ]
    fixes = f": this recording fixes {', '.join(fixed)} by itself" if fixed else ""
    return f"Nothing is tied that motion could part, and no interval is wide{fixes}."


def _find_least(subject: str, aims: Sequence[Aim], ratings: Sequence[float]) -> float:
    pairs = zip(aims, ratings, strict=True)
    return min(rating for aim, rating in pairs if aim.subject == subject)


def _is_shape(name: str) -> bool:
    effect, _, parameter = name.partition(".")
    return bool(parameter) and next(
        p.shape for p in BY_NAME[effect].parameters if p.name == parameter
    )

"""An alarm: which place of the chain has changed, how much, since when, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_bridge.watch.candidates import Candidate, compute_confidences
from pendulum_bridge.watch.signatures import Signature
from pendulum_bridge.watch.slips import Slip
from pendulum_twin.effects.effect import Place

SURE_CONFIDENCE = 0.99  # from which the place counts as known
EXPLAINED_MISFIT = 3.0  # times its degrees of freedom: the named change explains the windows
INTERVAL_DEVIATIONS = 1.96  # half a 95 % interval
UNKNOWN_CONFIDENCE = 0.5
SLIP_SENTENCES = (  # variable, unit and sentence of each joint
    ("cart_position", "m", "the cart's encoder slipped by {size}"),
    ("pole_angle", "rad", "the pole's encoder slipped by {size}"),
)


@dataclass(frozen=True)
class Alarm:
    """Hold what has changed.

    place: of the chain.
    effect: of the catalogue, or a constant of the rig.
    variable: what the change depends on.
    size: of the change, in unit.
    low, high: 95 % interval of size, as far as the windows' noise goes.
    unit: of size.
    since_ns: ns; stamp of about when the change began.
    raised_ns: ns; stamp of the sample that raised the alarm.
    confidence: the place's share in the likelihood of all changes tried.
    others: places that are not ruled out.
    explained: whether the change explains the windows, or only part of them.
    sentence: for a person.
    """

    place: Place
    effect: str
    variable: str
    size: float
    low: float
    high: float
    unit: str
    since_ns: int
    raised_ns: int
    confidence: float
    others: tuple[str, ...]
    explained: bool
    sentence: str

    @property
    def sure(self) -> bool:
        """Tell whether the place is beyond doubt."""
        return self.confidence >= SURE_CONFIDENCE and self.explained


def make_change_alarm(
    bank: Sequence[Signature], candidates: Sequence[Candidate], since_ns: int, raised_ns: int
) -> Alarm:
    """Return the alarm for fitted candidates, the likeliest first."""
    confidences = compute_confidences(bank, candidates)
    best = candidates[0]
    signature, explained = bank[best.number], best.misfit < EXPLAINED_MISFIT
    place = signature.place
    others = tuple(
        other.value
        for other, share in confidences.items()
        if other is not place and share > 1 - SURE_CONFIDENCE
    )
    doubt = f" (or {' or '.join(others)})" if others else ""
    rest = "" if explained else "; this explains only part of what is seen"
    half = INTERVAL_DEVIATIONS * best.deviation
    change = signature.sentence.format(size=_format_size(best.size, signature.unit))
    return Alarm(
        place=place,
        effect=signature.effect,
        variable=signature.variable,
        size=best.size,
        low=best.size - half,
        high=best.size + half,
        unit=signature.unit,
        since_ns=since_ns,
        raised_ns=raised_ns,
        confidence=confidences[place],
        others=others,
        explained=explained,
        sentence=f"{place.value}{doubt}: {change}{rest}",
    )


def make_unknown_alarm(joint: int, times: float, since_ns: int, raised_ns: int) -> Alarm:
    """Return the alarm for a joint that moves otherwise, for no known reason.

    joint: 0 cart, 1 pole.
    times: how far it is off, in units of its usual scatter.
    """
    place, variable = ((Place.CART, "cart_position"), (Place.POLE, "pole_angle"))[joint]
    sentence = (
        f"{place.value}: it moves otherwise than the twin says, {times:.3g} times the usual "
        "scatter off, and no change that is watched for explains it"
    )
    return Alarm(
        place=place,
        effect="unknown",
        variable=variable,
        size=times,
        low=times,
        high=times,
        unit="1",
        since_ns=since_ns,
        raised_ns=raised_ns,
        confidence=UNKNOWN_CONFIDENCE,
        others=(),
        explained=False,
        sentence=sentence,
    )


def make_slip_alarm(slip: Slip, since_ns: int, raised_ns: int) -> Alarm:
    """Return the alarm for a slip, which nothing else explains."""
    variable, unit, sentence = SLIP_SENTENCES[slip.joint]
    size, half = slip.leader.size, INTERVAL_DEVIATIONS * slip.leader.deviation
    return Alarm(
        place=Place.SENSOR,
        effect="encoder_slip",
        variable=variable,
        size=size,
        low=size - half,
        high=size + half,
        unit=unit,
        since_ns=since_ns,
        raised_ns=raised_ns,
        confidence=1.0,
        others=(),
        explained=True,
        sentence=f"{Place.SENSOR.value}: {sentence.format(size=_format_size(size, unit))}",
    )


def _format_size(size: float, unit: str) -> str:
    return f"{size:+.3g}" if unit == "1" else f"{size:+.3g} {unit}"

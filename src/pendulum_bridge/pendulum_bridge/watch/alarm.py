"""An alarm: which place of the chain has changed, by how much, since when, and how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_bridge.watch.rivals import Rival, confidences
from pendulum_bridge.watch.signatures import Signature
from pendulum_bridge.watch.slips import Slip
from pendulum_twin.effects.effect import Place

SURE = 0.99  # confidence from which the place counts as known
EXPLAINED = 3.0  # times its degrees of freedom, that the misfit may have when the named change explains the windows
SLIPS = (
    ("cart_position", "m", "the cart's encoder slipped by {size}"),
    ("pole_angle", "rad", "the pole's encoder slipped by {size}"),
)


@dataclass(frozen=True)
class Alarm:
    """Hold what has changed.

    place: of the chain. effect: what kind of change: an effect of the catalogue or a constant of
    the rig. variable: what it goes along with. size: of the change, in unit, with low and high of
    its 95 % interval as far as the windows' noise goes.
    since_ns: stamp of about when it began; raised_ns: of the sample that raised the alarm.
    confidence: share of the place in the likelihood of all changes tried. others: places that are
    not ruled out. explained: whether the change explains the windows, or only part of them.
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
        return self.confidence >= SURE and self.explained


def changed(
    bank: Sequence[Signature], fitted: Sequence[Rival], since_ns: int, raised_ns: int
) -> Alarm:
    """Return the alarm that the fitted rivals make; they come likeliest first."""
    shares = confidences(bank, fitted)
    best, place = fitted[0], bank[fitted[0].number].place
    signature, explained = bank[best.number], best.misfit < EXPLAINED
    others = tuple(
        other.value for other, share in shares.items() if other is not place and share > 1 - SURE
    )
    doubt = f" (or {' or '.join(others)})" if others else ""
    part = "" if explained else "; this explains only part of what is seen"
    off, said = (
        1.96 * best.deviation,
        signature.sentence.format(size=_shown(best.size, signature.unit)),
    )
    return Alarm(
        place,
        signature.effect,
        signature.variable,
        best.size,
        best.size - off,
        best.size + off,
        signature.unit,
        since_ns,
        raised_ns,
        shares[place],
        others,
        explained,
        f"{place.value}{doubt}: {said}{part}",
    )


def unknown(joint: int, times: float, since_ns: int, raised_ns: int) -> Alarm:
    """Return the alarm of a joint (0 cart, 1 pole) that moves otherwise for no known reason; times: its usual scatter."""
    place, variable = ((Place.CART, "cart_position"), (Place.POLE, "pole_angle"))[joint]
    said = (
        f"{place.value}: it moves otherwise than the twin says, {times:.3g} times the usual scatter off, and no change that "
        "is watched for explains it"
    )
    size = (times, times, times)
    return Alarm(place, "unknown", variable, *size, "1", since_ns, raised_ns, 0.5, (), False, said)


def slipped(slip: Slip, since_ns: int, raised_ns: int) -> Alarm:
    """Return the alarm of a slip, which nothing else explains."""
    variable, unit, sentence = SLIPS[slip.joint]
    size, off = slip.leader.size, 1.96 * slip.leader.deviation
    said = f"{Place.SENSOR.value}: {sentence.format(size=_shown(size, unit))}"
    interval = (size, size - off, size + off)
    return Alarm(
        Place.SENSOR,
        "encoder_slip",
        variable,
        *interval,
        unit,
        since_ns,
        raised_ns,
        1.0,
        (),
        True,
        said,
    )


def _shown(size: float, unit: str) -> str:
    return f"{size:+.3g}" if unit == "1" else f"{size:+.3g} {unit}"

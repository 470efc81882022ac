"""Score one answer: right, says less, or wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from pendulum_sysid.studies.proof.answers import read_answer
from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import NamesOutcome, OpenedTrial, Size
from pendulum_sysid.studies.proof.sizes import compare_effect_sizes, compute_mass_scale
from pendulum_twin.rig import Rig

WORST_SIZE_ERROR = 0.05  # relative, of an effect's size: what `targets` allows the median
WORST_HALF_WIDTHS = 2.0  # from estimate to truth: 4 standard errors, by chance 1 in 16,000
HIDDEN_FLOORS = 1.5  # held-out score over noise floor, up to which a miss does not show


class Score(Enum):
    """What an answer to a degraded recording is worth."""

    RIGHT = "right"  # all that was concealed, and sizes whose intervals can be believed
    LESS = "says less"  # a part, a tie, or that it cannot tell
    WRONG = "wrong"  # physics that is not there, or a size that it is not


@dataclass(frozen=True)
class Scored:
    """Hold the score of one answer.

    score: the score.
    why: the names or sizes behind it, in words.
    """

    score: Score
    why: str


def score_answer(
    trial: OpenedTrial, verdict: Mapping[str, Any], error: str, nominal: Rig
) -> Scored:
    """Return the score of a verdict (as verdict.json) on a recording of a trial's rig.

    error: that broke the diagnosis off; empty for none.
    nominal: constants that the diagnosis started from.
    """
    if error:
        return Scored(Score.WRONG, error)
    answer = read_answer(verdict)
    outcome = judge_names(trial.seal, answer).outcome
    named = ", ".join(answer.named) or "no name"
    if outcome in (NamesOutcome.WRONG, NamesOutcome.FALSE_ALARM):
        return Scored(Score.WRONG, f"{answer.outcome}: {named}")
    if outcome is NamesOutcome.ABSTAINED:
        return Scored(Score.LESS, f"{answer.outcome}: {named}")
    sizes = compare_effect_sizes(
        trial.seal,
        verdict.get("missing_physics") or [],
        compute_mass_scale(trial.seal, nominal),
    )
    off = [size for size in sizes if is_wrong_size(size)]
    if off:
        return Scored(Score.WRONG, "; ".join(describe_size(size) for size in off))
    if outcome is NamesOutcome.MISSED and not _is_at_floor(verdict):
        return Scored(Score.WRONG, "says that nothing is missing, far above the noise floor")
    if outcome.is_right:
        return Scored(Score.RIGHT, named)
    return Scored(Score.LESS, f"{outcome.value}: {named}")


def is_wrong_size(size: Size) -> bool:
    """Tell whether an estimate and its interval both mislead."""
    error = size.relative_error
    far = abs(size.value - size.true) > WORST_HALF_WIDTHS * size.half_width
    return far and (error is None or error > WORST_SIZE_ERROR)


def describe_size(size: Size) -> str:
    """Return an estimate with its interval beside the truth."""
    return (
        f"{size.owner}.{size.parameter} {size.value:.4g} [{size.low:.4g}, {size.high:.4g}], "
        f"in truth {size.true:.4g}"
    )


def _is_at_floor(verdict: Mapping[str, Any]) -> bool:
    fit = verdict.get("fit") or {}
    after, floor = (fit.get("held_out") or {}).get("after"), fit.get("noise_floor")
    return after is not None and floor is not None and after <= HIDDEN_FLOORS * floor

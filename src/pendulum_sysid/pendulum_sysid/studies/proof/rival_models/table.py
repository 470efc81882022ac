"""The table of rivals that predict: their scores on another recording beside the twin's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_sysid.studies.proof.statistics import RECORDING_S, Quantiles, compute_quantiles

TWIN = "improved_twin"
FLOORS = (1.5, 3.0)  # up to which physics counts as modelled


@dataclass(frozen=True)
class Predictor:
    """Hold how well one model predicts other recordings of rigs with unlisted physics.

    name: a rival's, or TWIN for the twin that the diagnosis improved.
    floors: of each judgement, the score over a perfect model's; None where there is none.
    within: for each of FLOORS, the share of rigs that are predicted so well.
    quantiles: of the floors.
    cpu_seconds: for a recording of 60 s, s.
    """

    name: str
    floors: tuple[float | None, ...]
    within: tuple[Share, ...]
    quantiles: Quantiles
    cpu_seconds: Quantiles


def list_unlisted(judgements: Sequence[Judgement]) -> list[Judgement]:
    """Return the trials with unlisted physics."""
    return [judgement for judgement in judgements if judgement.trial.seal.unlisted]


def list_models(judgements: Sequence[Judgement]) -> list[str]:
    """Return the rivals that predict and were asked about any of these trials."""
    return list(dict.fromkeys(name for judgement in judgements for name in judgement.models))


def compare_predictors(judgements: Sequence[Judgement]) -> list[Predictor]:
    """Return the improved twin and every rival that predicts, over trials with unlisted physics.

    A trial about which a rival was not asked, or broke off, counts for it as not predicted.
    """
    unlisted = list_unlisted(judgements)
    twin = _summarise(
        TWIN, [(j.modelled, j.cpu_seconds * RECORDING_S / j.trial.seconds) for j in unlisted]
    )
    rivals = []
    for name in list_models(unlisted):
        answers = [(judgement.trial, judgement.models.get(name)) for judgement in unlisted]
        rivals.append(
            _summarise(
                name,
                [
                    (a.floors, a.cpu_seconds * RECORDING_S / trial.seconds) if a else (None, None)
                    for trial, a in answers
                ],
            )
        )
    return [twin, *rivals]


def _summarise(name: str, answers: Sequence[tuple[float | None, float | None]]) -> Predictor:
    floors = tuple(score for score, _ in answers)
    return Predictor(
        name,
        floors,
        tuple(
            count_share(score is not None and score <= most for score in floors) for most in FLOORS
        ),
        compute_quantiles(floors),
        compute_quantiles(seconds for _, seconds in answers),
    )


def list_errors(judgements: Sequence[Judgement]) -> list[str]:
    """Return what broke rivals off, a sentence each."""
    return [
        f"{judgement.trial.name}, {name}: {model.error}"
        for judgement in list_unlisted(judgements)
        for name, model in judgement.models.items()
        if model.error
    ]

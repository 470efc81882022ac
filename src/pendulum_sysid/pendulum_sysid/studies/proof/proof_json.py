"""The proof as JSON: every figure, and every trial behind it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from pendulum_sysid.studies.proof.dose_response import Dose, Response
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.records import (
    Judgement,
    NamesJudgement,
    OpenedTrial,
    PairJudgement,
    Size,
)
from pendulum_sysid.studies.proof.rival_models.table import (
    FLOORS,
    Predictor,
    compare_predictors,
    list_models,
)
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import (
    Method,
    collect_rig_constants,
    collect_sizes,
    compare_methods,
    compute_coverage,
    count_confusion,
)
from pendulum_sysid.studies.proof.targets import Target, check_targets

SCHEMA = "pendulum_proof/1"
TRIAL_KEYS = ("kind", "seed", "pole_counts", "seconds", "closed_loop", "relay", "size_factor")


def make_proof_mapping(
    plan: Plan, judgements: Sequence[Judgement], responses: Sequence[Response], elapsed_s: float
) -> dict[str, Any]:
    """Return the proof in JSON's types."""
    matrix = count_confusion(judgements)
    return {
        "schema": SCHEMA,
        "plan": asdict(plan),
        "marks": [_map_target(target) for target in check_targets(judgements)],
        "methods": [_map_method(method) for method in compare_methods(judgements)],
        "predictors": [
            _map_predictor(predictor)
            for predictor in compare_predictors(judgements)
            if list_models(judgements)
        ],
        "confusion": [
            {
                "concealed": row,
                "named": column,
                "count": count,
                "tied": matrix.tied.get((row, column), 0),
            }
            for (row, column), count in sorted(matrix.counts.items())
        ],
        "coverage": {
            "sizes": _map_share(compute_coverage(collect_sizes(judgements))),
            "shapes": _map_share(compute_coverage(collect_sizes(judgements, shape=True))),
            "rig": _map_share(compute_coverage(collect_rig_constants(judgements))),
        },
        "dose_response": [
            {
                "effect": response.effect,
                "doses": [_map_dose(dose) for dose in response.doses],
                "least": None if response.least is None else _map_dose(response.least),
            }
            for response in responses
        ],
        "trials": [_map_judgement(judgement) for judgement in judgements],
        "elapsed_s": elapsed_s,
    }


def _map_share(share: Share | None) -> dict[str, Any] | None:
    return None if share is None else share.make_mapping()


def _map_target(target: Target) -> dict[str, Any]:
    return {
        "what": target.what,
        "found": target.result,
        "beside": target.beside,
        "mark": target.target,
        "met": target.met,
        "share": _map_share(target.share),
    }


def _map_method(method: Method) -> dict[str, Any]:
    return {
        "name": method.name,
        "right": {kind: _map_share(share) for kind, share in method.right.items()},
        "false_alarms": _map_share(method.false_alarms),
        "misnamed": _map_share(method.misnamed),
        "wrong": _map_share(method.wrong),
        "abstained": _map_share(method.abstained),
        "seconds": asdict(method.seconds),
    }


def _map_predictor(predictor: Predictor) -> dict[str, Any]:
    within = zip(FLOORS, predictor.within, strict=True)
    return {
        "name": predictor.name,
        "within": {f"{most:g}": _map_share(share) for most, share in within},
        "floors": asdict(predictor.quantiles),
        "cpu_seconds": asdict(predictor.cpu_seconds),
    }


def _map_dose(dose: Dose) -> dict[str, Any]:
    return {
        "effect": dose.effect,
        "factor": dose.factor,
        "found": _map_share(dose.named),
        "parameter": dose.parameter,
        "unit": dose.unit,
        "size": dose.size,
        "half_widths": dose.half_widths,
    }


def _map_judgement(judgement: Judgement) -> dict[str, Any]:
    held_out = judgement.held_out
    return {
        **_map_trial(judgement.trial),
        "answer": asdict(judgement.answer),
        "judged": _map_names(judgement.names),
        "sizes": [_map_size(size) for size in (*judgement.sizes, *judgement.rig)],
        "told_sizes": [_map_size(size) for size in judgement.oracle],
        "held_out": {
            "before": held_out.before,
            "after": held_out.after,
            "told": held_out.oracle,
            "floor": held_out.floor,
            "ratio": held_out.ratio,
        },
        "modelled": judgement.modelled,
        "pair": None if judgement.pair is None else _map_pair(judgement.pair),
        "diagnosis_seconds": judgement.seconds,
        "diagnosis_cpu_seconds": judgement.cpu_seconds,
        "rivals": {
            name: {
                "named": rival.named,
                "judged": _map_names(rival.names),
                "seconds": rival.seconds,
            }
            for name, rival in judgement.rivals.items()
        },
        "models": {name: asdict(model) for name, model in judgement.models.items()},
    }


def _map_pair(pair: PairJudgement) -> dict[str, Any]:
    return {
        "answer": asdict(pair.answer),
        "agree": pair.agree,
        "common": len(pair.common),
        "overlapping": pair.overlapping,
        "sizes": [_map_size(size) for size in pair.sizes],
        "given": pair.given,
        "improved": pair.improved,
    }


def _map_trial(trial: OpenedTrial) -> dict[str, Any]:
    return {
        "name": trial.name,
        **{key: getattr(trial, key) for key in TRIAL_KEYS},
        "effects": trial.seal.effects,
        "rig": trial.seal.rig,
        "unlisted": [asdict(effect) for effect in trial.seal.unlisted],
        "rest": [effect.name for effect in trial.seal.rest],
    }


def _map_names(names: NamesJudgement) -> dict[str, Any]:
    return {
        "how": names.outcome.value,
        "cells": [asdict(cell) for cell in names.cells],
        "located": names.located,
        "depends": names.depends,
    }


def _map_size(size: Size) -> dict[str, Any]:
    return {**asdict(size), "relative_error": size.relative_error, "inside": size.inside}

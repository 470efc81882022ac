"""Compare one examined trial with its seal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pendulum_sysid.studies.proof.answers import make_rival_answer, read_answer
from pendulum_sysid.studies.proof.judge_pair import judge_pair
from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import (
    HeldOut,
    Judgement,
    ModelJudgement,
    OpenedTrial,
    RivalJudgement,
    Seal,
    Size,
)
from pendulum_sysid.studies.proof.sizes import (
    compare_effect_sizes,
    compare_rig_constants,
    compute_mass_scale,
)
from pendulum_twin.rig import Rig


def judge_trial(trial: OpenedTrial, examined: Mapping[str, Any], nominal: Rig) -> Judgement:
    """Return a trial compared with its seal.

    examined: what `examine_trial` keeps.
    nominal: the constants that the diagnosis started from.
    """
    verdict, seal = examined["verdict"], trial.seal
    answer = read_answer(verdict, examined["error"])
    scale = compute_mass_scale(seal, nominal)
    oracle = examined.get("told") or {}
    sizes = compare_effect_sizes(seal, verdict.get("missing_physics") or [], scale)
    modelled, second = examined.get("modelled"), examined.get("second")
    return Judgement(
        trial=trial,
        answer=answer,
        names=judge_names(seal, answer),
        sizes=sizes,
        rig=compare_rig_constants(seal, verdict.get("rig_parameters") or {}, scale),
        oracle=compare_oracle_sizes(seal, oracle.get("estimates") or {}),
        held_out=read_held_out(verdict, oracle),
        seconds=float(examined["seconds"]),
        cpu_seconds=float(examined["cpu_seconds"]),
        rivals={
            name: _judge_rival(seal, entry, answer.stale)
            for name, entry in examined["rivals"].items()
        },
        models={
            name: ModelJudgement(**entry) for name, entry in (examined.get("models") or {}).items()
        },
        modelled=modelled,
        pair=judge_pair(seal, (answer, sizes), second, modelled, scale) if second else None,
    )


def read_held_out(verdict: Mapping[str, Any], oracle: Mapping[str, Any]) -> HeldOut:
    """Return the scores on held-out windows. oracle: what is kept of the oracle fit."""
    fit = verdict.get("fit") or {}
    scores = fit.get("held_out") or {}
    return HeldOut(
        scores.get("before"), scores.get("after"), oracle.get("score"), fit.get("noise_floor")
    )


def compare_oracle_sizes(
    seal: Seal, estimates: Mapping[str, Mapping[str, Any]]
) -> tuple[Size, ...]:
    """Return the concealed effects' parameters as the oracle fit has them.

    estimates: "effect.parameter" -> value with its interval; constants of the rig have no dot.
    """
    by_effect: dict[str, dict[str, Any]] = {}
    for name, estimate in estimates.items():
        effect, _, parameter = name.partition(".")
        if parameter:
            by_effect.setdefault(effect, {})[parameter] = estimate
    return compare_effect_sizes(
        seal, [{"effect": name, "parameters": values} for name, values in by_effect.items()]
    )


def _judge_rival(seal: Seal, entry: Mapping[str, Any], stale: bool) -> RivalJudgement:
    answer = make_rival_answer(entry["named"], stale, entry["error"])
    names = judge_names(seal, answer)
    return RivalJudgement(tuple(entry["named"]), names, float(entry["seconds"]))

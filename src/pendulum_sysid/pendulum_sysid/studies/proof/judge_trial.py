"""Judge one trial: what was examined against what the seal holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pendulum_sysid.records import Outcome
from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import (
    Answer,
    HeldOut,
    Judgement,
    OpenedTrial,
    RivalJudged,
    Size,
)
from pendulum_sysid.studies.proof.sizes import (
    compare_effect_sizes,
    compare_rig_constants,
    compute_mass_scale,
)
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.rig import Rig


def judge_trial(sealed: OpenedTrial, examined: Mapping[str, Any], nominal: Rig) -> Judgement:
    """Return a trial judged; examined: as `examine` keeps it. nominal: the constants that the diagnosis started from."""
    verdict = examined["verdict"]
    answer = read_answer(verdict, examined["error"])
    scale = compute_mass_scale(sealed, nominal)
    told = examined.get("told") or {}
    return Judgement(
        sealed=sealed,
        answer=answer,
        names=judge_names(sealed, answer),
        sizes=compare_effect_sizes(sealed, verdict.get("missing_physics") or [], scale),
        rig=compare_rig_constants(sealed, verdict.get("rig_parameters") or {}, scale),
        told=compare_oracle_sizes(sealed, told.get("estimates") or {}),
        held_out=read_held_out(verdict, told),
        seconds=float(examined["seconds"]),
        cpu_seconds=float(examined["cpu_seconds"]),
        rivals={
            name: _rival(sealed, one, answer.stale) for name, one in examined["rivals"].items()
        },
    )


def read_answer(verdict: Mapping[str, Any], error: str = "") -> Answer:
    """Return what a verdict says about names and place."""
    place = verdict.get("location") or {}
    return Answer(
        outcome=str(verdict.get("outcome", "")),
        named={
            one["effect"]: tuple(one["cannot_be_told_from"])
            for one in verdict.get("missing_physics") or []
        },
        stale=any(one["kind"] == "stale" for one in verdict.get("data_quality") or []),
        place=place.get("place"),
        variables=tuple(one["variable"] for one in place.get("evidence") or []),
        error=error,
    )


def make_rival_answer(named: list[str], stale: bool = False, error: str = "") -> Answer:
    """Return a rival's names as an answer; what no motion can part is excused as it is for the diagnosis.

    stale: whether stale samples were found; rivals get the recording without them.
    """
    outcome = Outcome.NAMED if named else Outcome.NOTHING_MISSING
    return Answer(
        outcome.value, {name: list_inseparable(name) for name in named}, stale, error=error
    )


def list_inseparable(name: str) -> tuple[str, ...]:
    """Return the effects that no motion can part from this one, by the catalogue."""
    shown = BY_NAME[name].shows_as
    return tuple(e.name for e in CATALOGUE if e.shows_as == name or e.name == shown)


def read_held_out(verdict: Mapping[str, Any], told: Mapping[str, Any]) -> HeldOut:
    """Return the scores on held-out windows."""
    fit = verdict.get("fit") or {}
    scores = fit.get("held_out") or {}
    return HeldOut(
        scores.get("before"), scores.get("after"), told.get("score"), fit.get("noise_floor")
    )


def compare_oracle_sizes(
    sealed: OpenedTrial, estimates: Mapping[str, Mapping[str, Any]]
) -> tuple[Size, ...]:
    """Return the concealed effects' parameters as the fit that was told the truth has them."""
    by_effect: dict[str, dict[str, Any]] = {}
    for name, one in estimates.items():
        effect, _, parameter = name.partition(".")
        if parameter:
            by_effect.setdefault(effect, {})[parameter] = one
    return compare_effect_sizes(
        sealed, [{"effect": name, "parameters": values} for name, values in by_effect.items()]
    )


def _rival(sealed: OpenedTrial, one: Mapping[str, Any], stale: bool) -> RivalJudged:
    answer = make_rival_answer(one["named"], stale, one["error"])
    return RivalJudged(tuple(one["named"]), judge_names(sealed, answer), float(one["seconds"]))

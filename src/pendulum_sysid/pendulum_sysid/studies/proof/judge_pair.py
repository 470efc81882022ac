"""Compare the answers to two recordings of a rig: names, sizes, and the improved twin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pendulum_sysid.studies.proof.answers import read_answer
from pendulum_sysid.studies.proof.names import match_inseparable
from pendulum_sysid.studies.proof.records import PairJudgement, Seal, Size, TrialAnswer
from pendulum_sysid.studies.proof.sizes import compare_effect_sizes


def judge_pair(
    seal: Seal,
    first: tuple[TrialAnswer, Sequence[Size]],
    second: Mapping[str, Any],
    improved: float | None,
    scale: float,
) -> PairJudgement:
    """Return how the answer to a second recording agrees with the first.

    first: the answer to the first recording, and its sizes beside the truth.
    second: what `examine_trial` keeps about the second recording.
    improved: score on the second recording of the twin improved by the first, over its floor.
    scale: see `sizes.compute_mass_scale`.
    """
    verdict = second["verdict"]
    answer = read_answer(verdict, second["error"])
    sizes = compare_effect_sizes(seal, verdict.get("missing_physics") or [], scale)
    named = {(size.owner, size.parameter): size for size in sizes}
    common = [
        (size, named[size.owner, size.parameter])
        for size in first[1]
        if (size.owner, size.parameter) in named
    ]
    return PairJudgement(
        answer=answer,
        agree=agree_in_names(first[0], answer),
        common=tuple(common),
        sizes=tuple(sizes),
        given=second["given"],
        improved=improved,
    )


def agree_in_names(a: TrialAnswer, b: TrialAnswer) -> bool:
    """Return whether two answers name the same effects, up to their own ties."""
    if a.error or b.error:
        return False
    only_a = [name for name in a.named if name not in b.named]
    only_b = [name for name in b.named if name not in a.named]
    ties = {
        name: [other for other in only_a if other in b.named[name] or name in a.named[other]]
        for name in only_b
    }
    return len(only_a) == len(only_b) == len(match_inseparable(only_a, ties))

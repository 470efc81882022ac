"""What a verdict, or a rival, says about names and place, as a `TrialAnswer`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pendulum_sysid import decisions
from pendulum_sysid.studies.proof.records import TrialAnswer
from pendulum_twin.errors import BadInputError


def read_answer(verdict: Mapping[str, Any], error: str = "") -> TrialAnswer:
    """Return what a verdict says about names and place.

    verdict: as verdict.json has it; may be empty for a diagnosis that broke off.
    error: the error that broke the diagnosis off; empty for none.
    Raises BadInputError when an entry lacks a key of `pendulum_verdict/1`.
    """
    location = verdict.get("location") or {}
    try:
        return TrialAnswer(
            outcome=str(verdict.get("outcome", "")),
            named={
                entry["effect"]: tuple(entry["cannot_be_told_from"])
                for entry in verdict.get("missing_physics") or []
            },
            stale=any(entry["kind"] == "stale" for entry in verdict.get("data_quality") or []),
            place=location.get("place"),
            variables=tuple(entry["variable"] for entry in location.get("evidence") or []),
            error=error,
            random=_is_random(verdict),
        )
    except (KeyError, TypeError, AttributeError) as reason:
        raise BadInputError(
            f"verdict: expected the entries of pendulum_verdict/1, found {reason!r} missing or odd"
        ) from reason


def _is_random(verdict: Mapping[str, Any]) -> bool:
    wandering = (verdict.get("remainder") or {}).get("wandering") or {}
    share = float(wandering.get("random_share", 0.0))
    return share >= decisions.RANDOM_LEAST_SHARE and not verdict.get("measured_laws")


def make_rival_answer(named: Sequence[str], stale: bool = False, error: str = "") -> TrialAnswer:
    """Return a rival's names as an answer.

    Effects that no motion can separate excuse a rival as they excuse the diagnosis.

    stale: whether stale samples were found; rivals get the recording without them.
    error: the error that broke the rival off; empty for none.
    """
    outcome = "named" if named else "nothing_missing"
    return TrialAnswer(
        outcome, {name: list_inseparable(name) for name in named}, stale, error=error
    )


def list_inseparable(name: str) -> tuple[str, ...]:
    """Return the effects that no motion can separate from this effect, by the catalogue."""
    from pendulum_twin.effects import BY_NAME, CATALOGUE

    shown = BY_NAME[name].shows_as
    return tuple(e.name for e in CATALOGUE if e.shows_as == name or e.name == shown)

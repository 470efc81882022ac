"""Read an earlier diagnosis back from its files: `verdict.json`, and `twin.yaml` beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from reprlib import repr as shown
from typing import Any

import numpy as np

from pendulum_sysid.errors import FileError, UnusableRecording, WrongUse
from pendulum_sysid.records import Outcome
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form
from pendulum_twin.files import read_json_object
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.schemas import VERDICT

OUTCOMES = [outcome.value for outcome in Outcome]


@dataclass(frozen=True)
class EarlierVerdict:
    """Hold what an earlier diagnosis ended with.

    twin: the improved twin; without its measured laws where effects are tied, for the tie is one
        of twins without laws.
    rivals: effect -> the effects that it could not be told from.
    digests: of its recordings; empty where the file names none.
    intervals: "key" of a constant or "effect.parameter" -> its 95 % interval.
    bands: measured law -> (knots,) half widths of its 95 % band.
    rig_changed: whether the rig changed between its recordings.
    """

    twin: Twin
    rivals: dict[str, tuple[str, ...]]
    digests: frozenset[str] = frozenset()
    intervals: dict[str, tuple[float, float]] = field(default_factory=dict)
    bands: dict[str, Floats] = field(default_factory=dict)
    rig_changed: bool = False

    @property
    def effects(self) -> tuple[str, ...]:
        """Return the effects that a fit to positions can turn."""
        return tuple(name for name in self.twin.effects if BY_NAME[name].form is not Form.REPORT)

    @property
    def known_constants(self) -> tuple[str, ...]:
        """Return the constants of the rig that the diagnosis took as known: it held them."""
        return tuple(name for name, sd in self.twin.spreads.items() if sd == 0.0)


def read_verdict(path: Path) -> EarlierVerdict:
    """Read an earlier diagnosis.

    Raises BadInputError when one of its files is missing or holds something else, and
    UnusableRecording when it found the recording unusable.
    """
    mapping = read_json_object(path, VERDICT, "a verdict")
    if mapping.get("outcome") not in OUTCOMES:
        raise FileError(
            f"{path}: expected an outcome ({', '.join(OUTCOMES)}), found "
            f"{shown(mapping.get('outcome'))}: name the verdict.json of a diagnosis"
        )
    rivals = _read_rivals(path, mapping.get("missing_physics"))
    if mapping["outcome"] == Outcome.UNUSABLE.value:
        raise UnusableRecording(
            f"{path}: expected a verdict on a usable recording, found 'unusable': record again"
        )
    digests = _read_digests(mapping.get("recording"))
    twin = load_twin(path.parent / "twin.yaml")
    if mapping["outcome"] == Outcome.AMBIGUOUS.value:
        twin = replace(twin, measured_laws={})
    changed = mapping.get("rig_changed") is True
    intervals, bands = _read_intervals(mapping), _read_bands(mapping)
    return EarlierVerdict(twin, rivals, digests, intervals, bands, changed)


def check_recordings(path: Path, earlier: EarlierVerdict, digests: Iterable[str]) -> None:
    """Raise WrongUse where a verdict is of none of the recordings at hand.

    path: of the verdict.
    digests: of the recordings.
    """
    if earlier.digests and earlier.digests.isdisjoint(digests):
        raise WrongUse(
            f"{path}: expected the verdict of these recordings, found that of others: name the "
            "recordings that it was made from, or leave out --verdict to diagnose these"
        )


def _read_digests(facts: object) -> frozenset[str]:
    """Return the digests of a verdict's recordings, which stand joined by a plus sign."""
    digest = facts.get("digest") if isinstance(facts, dict) else None
    return frozenset(digest.split(" + ")) if isinstance(digest, str) else frozenset()


def _read_intervals(mapping: dict[str, Any]) -> dict[str, tuple[float, float]]:
    """Return the intervals of constants and effects; NaN for an end that is not told."""
    groups = [("", mapping.get(key)) for key in ("rig_parameters", "effect_parameters")]
    for entry in (*mapping["missing_physics"], *_as_list(mapping.get("perhaps"))):
        if isinstance(entry, dict):
            groups.append((f"{entry.get('effect')}.", entry.get("parameters")))
    intervals = {}
    for prefix, parameters in groups:
        for name, facts in parameters.items() if isinstance(parameters, dict) else ():
            ends = [facts.get(end) if isinstance(facts, dict) else None for end in ("low", "high")]
            low, high = (float(e) if isinstance(e, int | float) else math.nan for e in ends)
            intervals[f"{prefix}{name}"] = (low, high)
    return intervals


def _read_bands(mapping: dict[str, Any]) -> dict[str, Floats]:
    """Return law -> (knots,) half widths of its band, of the laws that the verdict tells whole."""
    bands = {}
    for entry in _as_list(mapping.get("measured_laws")):
        if isinstance(entry, dict) and isinstance(entry.get("law"), str):
            low, high = (_as_list(entry.get(end)) for end in ("low", "high"))
            are_numbers = all(isinstance(value, int | float) for value in (*low, *high))
            if low and len(low) == len(high) and are_numbers:
                bands[entry["law"]] = 0.5 * (np.array(high, float) - np.array(low, float))
    return bands


def _as_list(entries: object) -> list[Any]:
    return entries if isinstance(entries, list) else []


def _read_rivals(path: Path, entries: object) -> dict[str, tuple[str, ...]]:
    """Return effect -> the effects that it could not be told from."""
    rivals: dict[str, tuple[str, ...]] = {}
    for entry in entries if isinstance(entries, list) else [None]:
        effect, others = (
            (entry.get("effect"), entry.get("cannot_be_told_from"))
            if isinstance(entry, dict)
            else (None, None)
        )
        if not (
            isinstance(effect, str)
            and isinstance(others, list)
            and all(isinstance(name, str) for name in others)
        ):
            raise FileError(
                f"{path}: expected missing_physics to be a list of effects, each with its name "
                f"(effect) and a list of names (cannot_be_told_from), found {shown(entries)}: "
                "name the verdict.json of a diagnosis"
            )
        rivals[effect] = tuple(others)
    return rivals

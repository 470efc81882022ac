"""Diagnose a kept trial down to what is compared: the outcome and the names."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pendulum_sysid import beside_laws, pipeline
from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.finding import growth, journal, naming, pole_alone, search, signs
from pendulum_sysid.finding.journal import report_nothing
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.best_laws import Starts
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Fit, Split
from pendulum_sysid.studies.ablation.memory import Memory
from pendulum_twin.arrays import Floats
from pendulum_twin.model import load_twin


@dataclass(frozen=True)
class Short:
    """Hold what is compared of a verdict: its outcome, and the names of effects and laws in it."""

    outcome: str
    names: frozenset[str]


class Diagnosis:
    """Diagnose one trial again and again, with a memory of the expensive stages.

    folder: of the trial, with `bag` and `twin.yaml`.
    """

    def __init__(self, folder: Path, memory: Memory) -> None:
        self._memory, self._twin = memory, load_twin(folder / "twin.yaml")
        self._raw = read_bag(folder / "bag")

    def decide(self) -> Short:
        """Return the outcome and the names with the decisions as they stand."""
        with remember_stages(self._memory):
            verdict = pipeline.diagnose([clean_recording(self._raw)], self._twin, report_nothing)
        effects = [effect.effect for effect in verdict.missing_physics]
        laws = [law.law for law in verdict.measured_laws]
        return Short(verdict.outcome.value, frozenset([*effects, *laws]))


@contextmanager
def remember_stages(memory: Memory) -> Iterator[None]:
    """Give the expensive steps of search and judgement a memory."""
    stages: tuple[tuple[Any, str, Any], ...] = (
        (journal, "fit", _key_fit),
        (signs, "fit", _key_fit),
        (pole_alone, "fit", _key_fit),
        (growth, "propose", _key_all),
        (naming, "propose", _key_all),
        (search, "find_ties", _key_ties),
        (naming, "read_effects", lambda case, theta, use: (*_key(case), theta.tobytes(), use)),
        (beside_laws, "measure_best_laws", _key_laws),
        (pipeline, "plan_next_experiment", _key_plan),
    )
    plain = [getattr(module, name) for module, name, _ in stages]
    for (module, name, key), function in zip(stages, plain, strict=True):
        setattr(module, name, memory.wrap(function, key))
    try:
        yield
    finally:
        for (module, name, _), function in zip(stages, plain, strict=True):
            setattr(module, name, function)


def _key(record: Case | Split | Fit) -> tuple[Hashable, ...]:
    """Return what tells a record from others of the same trial."""
    if isinstance(record, Fit):
        fitted = (record.theta, record.start_states, record.power)
        return (record.effects, record.pieces, *(values.tobytes() for values in fitted))
    if isinstance(record, Split):
        parts = (record.train, record.choose, record.held_out)
        return tuple(windows.begin.tobytes() for windows in parts)
    signals, state = record.signals, record.state
    digest = hashlib.sha256()
    for array in (
        signals.command, signals.cart, signals.pole, signals.cart_valid, signals.pole_valid,
        record.recording.rates, state.states, state.accelerations,
    ):  # fmt: skip
        digest.update(b"none" if array is None else array.tobytes())
    return (digest.digest(), repr(signals.stretch_begins), repr(state.noise), repr(record.scales))


def _key_all(*records: Case | Split | Fit) -> tuple[Hashable, ...]:
    return tuple(part for record in records for part in _key(record))


def _key_fit(
    case: Case, split: Split, effects: Any, theta: Any, parts: int, starts: Any = None
) -> tuple[Hashable, ...]:
    known = None if starts is None else starts.tobytes()
    return (*_key_all(case, split), effects, theta.tobytes(), parts, known)


def _key_ties(case: Case, split: Split, fit: Fit, also: Any) -> tuple[Hashable, ...]:
    return (*_key_all(case, split, fit), repr(sorted(also.items())))


def _key_plan(
    case: Case, split: Split, best: Fit, ties: Any, bands: Mapping[str, Floats]
) -> tuple[Hashable, ...]:
    widths = tuple((law, bands[law].tobytes()) for law in sorted(bands))
    return (*_key_all(case, split, best), repr(ties), widths)


def _key_laws(case: Case, split: Split, starts: Starts, progress: Any) -> tuple[Hashable, ...]:
    more = starts.without_doubtful
    fits = starts.fits if more is None else (*starts.fits, more)
    return (*_key_all(case, split, *fits), more is None, starts.names, starts.cancelled)

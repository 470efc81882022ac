"""Diagnose a kept trial down to what is compared: the outcome and the names."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.finding import growth, journal, naming, pole_alone, search, signs
from pendulum_sysid.finding.detectors import Use, read_effects
from pendulum_sysid.finding.localisation.shape_check import (
    find_misfits,
    is_outweighed,
    measure_remainders,
)
from pendulum_sysid.finding.search import search_effects
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Fit, Outcome, Split
from pendulum_sysid.studies.ablation.memory import Memory
from pendulum_sysid.telling.outcome import Findings, decide_outcome, is_motion_effect
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin


@dataclass(frozen=True)
class Short:
    """Hold what is compared of a verdict: its outcome and the names in it."""

    outcome: str
    names: frozenset[str]


class Diagnosis:
    """Diagnose one trial again and again, with a memory of every stage.

    folder: of the trial, with `bag` and `twin.yaml`.
    """

    def __init__(self, folder: Path, memory: Memory) -> None:
        self.twin = load_twin(folder / "twin.yaml")
        self._memory = memory
        self._prepare = memory.wrap(_prepare_trial, lambda folder, twin: str(folder))
        self._judge = memory.wrap(_judge_shapes, _key_judging)
        self._read_certain = memory.wrap(
            _read_certain, lambda case, fit: (*_key(case), *_key(fit))
        )
        self._folder = folder

    def decide(self) -> Short:
        """Return the outcome and the names with the decisions as they stand."""
        try:
            prepared: Prepared = self._prepare(self._folder, self.twin)
        except BadInputError:
            return Short(Outcome.UNUSABLE.value, frozenset())
        case, split = prepared.case, prepared.split
        with remember_stages(self._memory):
            answer = search_effects(case, split)
        names = tuple(named.effect for named in answer.named)
        judged = self._judge(case, split, answer.best, answer.base, names)
        findings = SimpleNamespace(named=answer.named, base=answer.base, best=answer.best)
        findings.misfits, findings.outweighed, findings.learned_misfit = judged
        outcome = decide_outcome(cast(Findings, findings))
        if outcome is Outcome.NOT_IN_CATALOGUE:
            names = tuple(name for name in names if not is_motion_effect(name))
            names = (*names, *self._read_certain(case, answer.base))
        return Short(outcome.value, frozenset(names))


@contextmanager
def remember_stages(memory: Memory) -> Iterator[None]:
    """Give the search's expensive steps a memory."""
    stages: tuple[tuple[Any, str, Any], ...] = (
        (journal, "fit", _key_fit),
        (signs, "fit", _key_fit),
        (pole_alone, "fit", _key_fit),
        (growth, "propose", _key_all),
        (naming, "propose", _key_all),
        (search, "find_ties", _key_ties),
        (naming, "read_effects", lambda case, theta, use: (*_key(case), theta.tobytes(), use)),
    )
    plain = [getattr(module, name) for module, name, _ in stages]
    for (module, name, key), function in zip(stages, plain, strict=True):
        setattr(module, name, memory.wrap(function, key))
    try:
        yield
    finally:
        for (module, name, _), function in zip(stages, plain, strict=True):
            setattr(module, name, function)


def _prepare_trial(folder: Path, twin: Twin) -> Prepared:
    return prepare([clean_recording(read_bag(folder / "bag"))], twin)


def _judge_shapes(
    case: Case, split: Split, best: Fit, base: Fit, names: tuple[str, ...]
) -> tuple[tuple[str, ...], bool, float]:
    """Return the names whose shape is wrong, whether they are outweighed, and the misfit left."""
    remainders = measure_remainders(case, best, base)
    misfits = find_misfits(case, best.theta, remainders, names)
    whole = refine_start_states(case.problem(split.learn), best.theta).misfit(case.noise)
    return tuple(m.effect for m in misfits), is_outweighed(remainders), whole


def _read_certain(case: Case, base: Fit) -> tuple[str, ...]:
    return tuple(reading.effect for reading in read_effects(case, base.theta, Use.CERTAIN))


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


def _key_judging(
    case: Case, split: Split, best: Fit, base: Fit, names: tuple[str, ...]
) -> tuple[Hashable, ...]:
    return (*_key_all(case, split, best, base), names)

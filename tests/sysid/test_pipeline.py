"""Rules of the pipeline between the search's answer and the verdict."""

from collections.abc import Iterable
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from pendulum_sysid import pipeline
from pendulum_sysid.planning.next_experiment import CHANGED
from pendulum_sysid.records import Outcome

TIES = tuple(
    SimpleNamespace(effect=effect, rival=rival, by_no_motion=never)
    for effect, rival, never in (
        ("input_delay", "sensor_delay", True),
        ("input_delay", "motor_lag", False),
        ("rail_tilt", "load_put_on", True),
    )
)


@dataclass(frozen=True)
class Planned:
    with_laws: str | None
    change: object = None
    named: tuple[SimpleNamespace, ...] = (SimpleNamespace(effect="input_delay"),)
    ties: tuple[SimpleNamespace, ...] = TIES
    best: str = "names"
    case: None = None
    bands: None = None
    coming: object = None


@pytest.mark.parametrize(
    ("fit", "change", "outcome", "coming"),
    [
        (None, None, Outcome.NAMED, ("names", ["sensor_delay", "motor_lag", "load_put_on"])),
        ("laws", None, Outcome.AMBIGUOUS, ("names", ["sensor_delay", "motor_lag", "load_put_on"])),
        ("laws", None, Outcome.NOT_IN_CATALOGUE, ("laws", ["sensor_delay"])),
        (None, "a load", Outcome.NOT_IN_CATALOGUE, CHANGED),
    ],
)
def test_the_next_experiment_is_for_the_fit_that_the_verdict_tells(
    monkeypatch: pytest.MonkeyPatch,
    fit: str | None,
    change: str | None,
    outcome: Outcome,
    coming: object,
) -> None:
    """A viscosity known to 4 % was said to be known to +-0.0021, of a value of 0.0001."""
    monkeypatch.setattr(pipeline, "decide_outcome", lambda findings: outcome)
    monkeypatch.setattr(
        pipeline,
        "plan_next_experiment",
        lambda case, split, best, kept, bands: (best, [tie.rival for tie in kept]),
    )
    assert pipeline.plan_next(Planned(fit, change), None).coming == coming


@dataclass(frozen=True)
class Judged:
    named: tuple[SimpleNamespace, ...]
    case: None = None


def name(*effects: str) -> Judged:
    return Judged(tuple(SimpleNamespace(effect=effect) for effect in effects))


SIMPLE, WIDE = name("input_saturation"), name("motor_current_limit")


@pytest.mark.parametrize(
    ("wider", "again", "rest", "at_noise", "behind", "stands"),
    [
        ("motor_current_limit", WIDE, "laws beside it", False, False, True),
        ("motor_current_limit", WIDE, "laws beside it", False, True, False),
        ("motor_current_limit", WIDE, None, True, False, True),
        ("motor_current_limit", WIDE, None, False, False, False),
        ("motor_current_limit", name(), "laws beside it", False, False, False),
        (None, WIDE, "laws beside it", False, False, False),
    ],
    ids=["better", "behind", "at the noise", "laws gone", "no name then", "not asked for"],
)
def test_a_wider_effect_takes_the_place_of_a_name_where_laws_ask_for_it(
    monkeypatch: pytest.MonkeyPatch,
    wider: str | None,
    again: Judged,
    rest: str | None,
    at_noise: bool,
    behind: bool,
    stands: bool,
) -> None:
    """Laws beside a saturation followed what a motor's counter voltage does: 7.5 floors left."""

    def find_wider(measured: str, names: Iterable[str]) -> SimpleNamespace | None:
        assert list(names) == ["input_saturation"]
        return None if wider is None else SimpleNamespace(effects=(wider,))

    answers: dict[str, object] = {
        "find_wider_effects": find_wider,
        "search_in_place": lambda *about: None,
        "judge_answer": lambda *about: again,
        "measure_rest": lambda *about: rest,
        "is_above_noise": lambda findings: not at_noise,
        "is_better": lambda simple, rich, has_names: behind,
    }
    for function, answer in answers.items():
        monkeypatch.setattr(pipeline, function, answer)
    answer = SimpleNamespace(best=SimpleNamespace(effects=("input_saturation",)))
    kept = pipeline.widen_names(SIMPLE, None, answer, "laws", lambda line: None)
    assert kept == ((again, rest) if stands else (SIMPLE, "laws"))

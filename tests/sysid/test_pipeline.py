"""Rules of the pipeline between the search's answer and the verdict."""

from collections.abc import Iterable
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from pendulum_sysid import pipeline
from pendulum_sysid.planning.next_experiment import CHANGED
from pendulum_sysid.records import Outcome

WIDER = "motor_current_limit"
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


SIMPLE, WIDE, TOLD = name("input_saturation"), name("motor_current_limit"), name(WIDER)


@pytest.mark.parametrize(
    ("wider", "rest", "told", "at_noise", "behind", "stays"),
    [
        (WIDER, "laws beside it", TOLD, False, False, TOLD),
        (WIDER, "laws beside it", TOLD, False, True, None),
        (WIDER, "laws beside it", WIDE, False, False, None),
        (WIDER, "laws beside it", name(), False, False, None),
        (WIDER, None, TOLD, True, False, WIDE),
        (WIDER, None, TOLD, False, False, None),
        ("", "laws beside it", TOLD, False, False, None),
    ],
    ids=[
        "better", "behind", "its laws go", "no name then", "at the noise", "no laws",
        "not asked for",
    ],
)  # fmt: skip
def test_a_wider_effect_takes_the_place_of_a_name_where_laws_ask_for_it(
    monkeypatch: pytest.MonkeyPatch,
    wider: str,
    rest: str | None,
    told: Judged,
    at_noise: bool,
    behind: bool,
    stays: Judged | None,
) -> None:
    """Laws beside a saturation followed what a motor's counter voltage does: 7.5 floors left."""

    def find_wider(measured: str, names: Iterable[str]) -> dict[str, list[float]]:
        assert list(names) == ["input_saturation"]
        return {wider: [0.2, 0.7]} if wider else {}

    answers: dict[str, object] = {
        "find_wider_effects": find_wider,
        "search_in_place": lambda *about: None,
        "judge_answer": lambda *about: WIDE,
        "measure_rest": lambda *about: rest,
        "add_laws": lambda *about: told,
        "is_above_noise": lambda findings: not at_noise,
        "is_better": lambda simple, rich, names: behind,
    }
    for function, answer in answers.items():
        monkeypatch.setattr(pipeline, function, answer)
    assert pipeline.widen_names(SIMPLE, None, None, "laws", lambda line: None) is stays

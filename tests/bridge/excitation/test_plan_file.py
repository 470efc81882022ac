"""Plan files are read back as they were written, and whatever is wrong in one is named."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from support.paths import CONFIG

from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.plan_file import (
    Plan,
    load_plan,
    make_excitation,
    parse_plan,
    read_plan,
    save_plan,
)
from pendulum_twin.plans.plan_phases import (
    KINDS,
    Chirp,
    FreeDecay,
    Multisine,
    Push,
    Rest,
    Samples,
    Standard,
    Steps,
)
from pendulum_twin.plans.waveforms import Envelope, make_envelope
from pendulum_twin.rig import Rig

CHIRP = {"kind": "chirp", "seconds": 2, "from_hz": 0.5, "to_hz": 3, "amplitude": 0.3}
EXAMPLES = sorted((CONFIG / "plans").glob("*.yaml"))

SECONDS = st.floats(0.1, 100)
AMPLITUDES = st.floats(0.001, 0.5)
SEEDS = st.integers(0, 2**32 - 1)
PHASES = st.one_of(
    st.builds(Push, seconds=st.floats(0.9, 5)),
    st.builds(Rest, seconds=SECONDS, centred=st.booleans()),
    st.builds(
        Chirp,
        seconds=SECONDS,
        from_hz=st.floats(0.01, 10),
        to_hz=st.floats(0.01, 10),
        amplitude=AMPLITUDES,
    ),
    st.builds(
        Multisine,
        seconds=SECONDS,
        amplitude=AMPLITUDES,
        tones_hz=st.lists(st.floats(0.01, 10), min_size=1, max_size=9).map(tuple),
        seed=SEEDS,
        centred=st.booleans(),
    ),
    st.builds(
        Steps, seconds=SECONDS, amplitude=AMPLITUDES, hold_s=st.floats(0.02, 10), seed=SEEDS
    ),
    st.builds(
        FreeDecay, seconds=st.floats(10, 100), amplitude=AMPLITUDES, swings=st.integers(1, 5)
    ),
    st.builds(
        Samples, commands=st.lists(st.floats(-0.5, 0.5), min_size=1, max_size=50).map(tuple)
    ),
    st.builds(Standard, seconds=st.floats(40, 100), seed=SEEDS),
)


def file(*phases: dict, **head: object) -> dict:
    return {"schema": "pendulum_plan/1", **head, "phases": list(phases)}


@settings(deadline=None, max_examples=60)
@given(
    phases=st.lists(PHASES, min_size=1, max_size=6).map(tuple),
    name=st.text(min_size=1),
    rate_hz=st.floats(20, 1000),
    limit=st.none() | st.floats(0.01, 1),
)
def test_a_plan_is_read_back_as_it_was_written(
    tmp_path_factory, phases, name, rate_hz, limit
) -> None:
    plan = Plan(phases, name, rate_hz, limit)
    path = tmp_path_factory.mktemp("plan") / "plan.yaml"
    save_plan(plan, path)
    assert read_plan(path) == plan


def test_the_format_is_as_documented(tmp_path) -> None:
    """The example of the documentation, letter by letter, and its table of keys."""
    from pendulum_twin.plans import plan_file

    example, table = re.findall(r"\n\n((?:    .*\n)+)", plan_file.__doc__)
    (tmp_path / "plan.yaml").write_text(example)
    plan = load_plan(tmp_path / "plan.yaml")
    assert len(plan.commands) == 150 + 2000 + 5 + 300 and plan.limit == 0.3
    assert plan.commands[2150:2155].tolist() == [0.1, 0.1, -0.1, -0.1, 0.0]
    documented = {
        line.split()[0]: re.sub(r"\(.*?\)", "", line).replace(",", "").split()[1:]
        for line in table.splitlines()
    }
    assert documented == {
        name: [entry.name for entry in fields(kind)] for name, kind in KINDS.items()
    }


def test_defaults_are_those_of_the_documentation() -> None:
    plan = parse_plan(
        file({"kind": "push"}, {"kind": "standard"}, CHIRP, {"kind": "rest", "seconds": 1})
    )
    assert plan.rate_hz == 100 and plan.limit is None and plan.name == "plan"
    assert plan.phases[0].seconds == 1.5 and plan.phases[1].seconds == 60
    assert plan.phases[2].centred and not plan.phases[3].centred


def test_the_standard_plan_as_a_phase_is_the_standard_plan() -> None:
    made, known = (
        make_excitation(Plan((Standard(seconds=45, seed=3),)), Envelope()),
        make_standard_plan(seconds=45, seed=3),
    )
    for name in ("commands", "centring"):
        assert np.array_equal(getattr(made, name), getattr(known, name))
    assert (made.push_ends, made.stretches, made.limit) == (
        known.push_ends,
        known.stretches,
        known.limit,
    )


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_load_and_end_in_rest(path: Path, nominal: Rig) -> None:
    plan = load_plan(path, make_envelope(nominal))
    assert read_plan(path).name == path.stem
    assert 30 <= plan.seconds <= 60 and plan.push_ends is not None
    assert np.all(plan.commands[-100:] == 0) and np.max(np.abs(plan.commands)) > 0.2


def test_there_is_an_example_of_each_kind_that_needs_one() -> None:
    assert {path.stem for path in EXAMPLES} >= {"chirp", "multisine", "steps", "free_decay"}


PUSH = {"kind": "push"}
WRONG = [
    ([], "expected a mapping with schema and phases, found []"),
    ({"schema": "pendulum_plan/2"}, "schema: expected pendulum_plan/1, found 'pendulum_plan/2'"),
    ({}, "schema: expected pendulum_plan/1, found None"),
    (file(PUSH, rate=100), "plan file: unknown key rate; did you mean rate_hz?"),
    (
        file(PUSH, seconds=3),
        "plan file: unknown key seconds; known are schema, name, rate_hz, limit, phases",
    ),
    (file(PUSH, rate_hz="fast"), "rate_hz: expected a number, found 'fast'"),
    (file(PUSH, rate_hz=5), "rate_hz: expected a number from 20 to 1000, found 5"),
    (file(PUSH, rate_hz=float("nan")), "rate_hz: expected a number, found '.nan'"),
    (file(PUSH, limit=[0.1]), "limit: expected a number, found [0.1]"),
    (file(PUSH, limit=10**400), "limit: expected a number from 1e-06 to 1e+06, found 1000"),
    (file(PUSH, name=3), "name: expected text, found 3"),
    (file(), "phases: expected a list of 1 to 1000 phases, found []"),
    (
        {**file(), "phases": PUSH},
        "phases: expected a list of 1 to 1000 phases, found {'kind': 'push'}",
    ),
    (file("rest"), "phases[0]: expected a mapping with kind, found 'rest'"),
    (file({"seconds": 3}), "phases[0]: kind: expected one of push, rest, chirp"),
    (file({"kind": "nudge"}), "found 'nudge'"),
    (file({"kind": ["push"]}), "found ['push']"),
    (
        file(PUSH, {**CHIRP, "to": 3}),
        "phases[1] (chirp): unknown key to; did you mean to_hz?",
    ),
    (file(PUSH, {"kind": "rest"}), "phases[1] (rest): expected seconds, found it missing"),
    (
        file(PUSH, {**CHIRP, "seconds": 0}),
        "phases[1] (chirp): seconds: expected a number from 0.1 to 3600, found 0",
    ),
    (
        file(PUSH, {**CHIRP, "seconds": True}),
        "phases[1] (chirp): seconds: expected a number, found True",
    ),
    (
        file(PUSH, {**CHIRP, "from_hz": None}),
        "phases[1] (chirp): from_hz: expected a number, found None",
    ),
    (
        file(PUSH, {**CHIRP, "amplitude": float("inf")}),
        "amplitude: expected a number, found '.inf'",
    ),
    (
        file(PUSH, {**CHIRP, "centred": 1}),
        "phases[1] (chirp): centred: expected true or false, found 1",
    ),
    (file(PUSH, {**CHIRP, "kind": "steps"}), "phases[1] (steps): unknown key from_hz"),
    (
        file({"kind": "samples", "commands": []}),
        "commands: expected a list of 1 to 1000000 numbers, found []",
    ),
    (file({"kind": "samples", "commands": [0, "x"]}), "commands[1]: expected a number, found 'x'"),
    (file({"kind": "samples", "commands": [0, [0]]}), "commands[1]: expected a number, found [0]"),
    (
        file({"kind": "standard", "seed": 0.5}),
        "seed: expected a whole number from 0 to 4294967295, found 0.5",
    ),
    (
        file({"kind": "standard", "seconds": 20}),
        "phases[0] (standard): seconds: expected a number from 40 to 3600, found 20",
    ),
    (
        file({"kind": "push", "seconds": 0.5}),
        "phases[0] (push): seconds: expected a number from 0.9 to 3600, found 0.5",
    ),
]


@pytest.mark.parametrize(
    ("mapping", "sentence"), WRONG, ids=lambda entry: entry[:60] if isinstance(entry, str) else ""
)
def test_what_is_wrong_is_named(mapping: object, sentence: str, tmp_path) -> None:
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(mapping))
    with pytest.raises(BadInputError, match=r"plan\.yaml: .*" + re.escape(sentence)):
        load_plan(tmp_path / "plan.yaml")


@pytest.mark.parametrize(
    ("plan", "sentence"),
    [
        (
            Plan((Push(), Chirp(seconds=1, from_hz=1, to_hz=2, amplitude=0.51))),
            "phases[1] (chirp): amplitude: expected at",
        ),
        (
            Plan((Push(), Steps(seconds=1, amplitude=0.4)), limit=0.3),
            "amplitude: expected at most the limit 0.3, found 0.4",
        ),
        (
            Plan((Push(), Multisine(seconds=1, amplitude=2.0))),
            "amplitude: expected at most the limit 0.5, found 2",
        ),
        (
            Plan((Push(), FreeDecay(seconds=9, amplitude=0.6))),
            "amplitude: expected at most the limit 0.5, found 0.6",
        ),
        (
            Plan((Push(), Samples(commands=(0.1, -0.6)))),
            "phases[1] (samples): commands[1]: expected from -0.5 to 0.5, found",
        ),
        (Plan((Push(),), limit=0.6), "limit: expected at most the rig's 0.5, found 0.6"),
        (
            Plan((Push(), FreeDecay(seconds=1, amplitude=0.1))),
            "seconds: expected more than the 1.87 s that 2 swings take",
        ),
        (
            Plan((Push(), Chirp(seconds=1, from_hz=1, to_hz=60, amplitude=0.1))),
            "to_hz: expected at most 50 Hz, half of rate",
        ),
        (
            Plan((Push(), Multisine(seconds=1, tones_hz=(1, 60), amplitude=0.1))),
            "tones_hz[1]: expected at most 50 Hz",
        ),
        (
            Plan((Rest(seconds=1, centred=True),)),
            "phases[0]: expected kind push or standard, found rest: what is centred",
        ),
        (
            Plan((Rest(seconds=1), Push(), Steps(seconds=1, amplitude=0.1))),
            "put {kind: push} first, or give centred: false",
        ),
        (
            Plan((Rest(seconds=2000), Rest(seconds=2000))),
            "phases: expected at most 3600 s and 1000000 samples in all, found",
        ),
    ],
    ids=lambda entry: entry[:60] if isinstance(entry, str) else "",
)
def test_what_the_rig_does_not_allow_is_named(plan: Plan, sentence: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make_excitation(plan, Envelope())


def test_phases_check_themselves_without_a_file() -> None:
    with pytest.raises(BadInputError, match="amplitude: expected a number from"):
        Steps(seconds=1, amplitude=-0.1)
    with pytest.raises(BadInputError, match="phases: expected at least one phase, found none"):
        Plan(())


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a: [", "expected YAML, found"),
        (
            "!!python/object/apply:os.getcwd []",
            "line 1: expected plain values, found the YAML tag",
        ),
        ("[" * 5000, "line 1: expected at most 20 levels of nesting, found more"),
        ("schema: 2001-99-99", "schema: expected pendulum_plan/1, found '2001-99-99'"),
        ("\x00", "expected YAML, found"),
        ("", "expected a plan file, found it empty"),
    ],
)
def test_what_is_no_yaml_is_refused(text: str, sentence: str, tmp_path) -> None:
    (tmp_path / "plan.yaml").write_text(text)
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        load_plan(tmp_path / "plan.yaml")


@pytest.mark.parametrize("key", ["limit", "name", "rate_hz", "phases", "schema", "other"])
def test_a_value_whose_text_never_ends_is_refused_at_once(key: str, tmp_path) -> None:
    """Sixty lists, each of the one before twice: 2^60 words when written out."""
    lists = ["&a0 [x, x]", *(f"&a{k} [*a{k - 1}, *a{k - 1}]" for k in range(1, 60))]
    head = {"schema": "pendulum_plan/1", "phases": "[{kind: push}]", key: f"[{', '.join(lists)}]"}
    (tmp_path / "plan.yaml").write_text(
        "".join(f"{name}: {value}\n" for name, value in head.items())
    )
    with pytest.raises(BadInputError) as error:
        load_plan(tmp_path / "plan.yaml")
    sentence = f"plan.yaml: line {1 + list(head).index(key)}: expected values written out"
    assert sentence in str(error.value) and len(str(error.value)) < 1000


def test_a_file_that_is_not_there_is_named() -> None:
    with pytest.raises(
        BadInputError, match=r"/no/such\.yaml: expected a plan file, but it cannot be read"
    ):
        load_plan("/no/such.yaml")

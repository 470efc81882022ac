"""A wrong value of a file is refused with its line, a misspelt name with a hint."""

from pathlib import Path

import pytest
from support.paths import ROOT

from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin
from pendulum_twin.plans.plan_file import read_plan
from pendulum_twin.suggest import suggest_names

TWIN = (ROOT / "config" / "inteco.yaml").read_text(encoding="utf-8")
EFFECT = "effects:\n  cogging: {amplitude_n: 1.0, period_m: 0.1, phase_rad: 0.0}\n"
PLAN = (
    "schema: pendulum_plan/1\nphases:\n- kind: push\n"
    "- {kind: chirp, seconds: 5, from_hz: 1, to_hz: 3,\n   amplitude: 0.1}\n- kind: rest\n"
)


def line_of(text: str, words: str) -> int:
    return 1 + text[: text.index(words)].count("\n")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cart_mass_kg: ", "cart_mas_kg: ", "unknown key cart_mas_kg; did you mean cart_mass_kg"),
        ("gravity_m_s2: 9.81", "gravity_m_s2: -1", "gravity_m_s2: expected a number from 0 to"),
        ("schema: pendulum_twin/1", "schema: twin", "expected schema: pendulum_twin/1"),
        ("name: inteco", "nmae: inteco", "unknown key nmae; did you mean name?"),
    ],
)
def test_a_wrong_key_of_a_twin_file_has_its_line(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert old in TWIN
    text = TWIN.replace(old, new)
    path = tmp_path / "twin.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError) as refused:
        load_twin(path)
    assert str(refused.value).startswith(f"{path}: line {line_of(text, new.split()[0])}: ")
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("cogging", "coging", "unknown effect coging; did you mean cogging?"),
        ("phase_rad", "fase_rad", "unknown key fase_rad; did you mean phase_rad?"),
        ("period_m: 0.1", "period_m: -3", "effects: cogging: period_m: expected a number"),
    ],
)
def test_a_wrong_effect_has_its_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    head = TWIN[: TWIN.index("effects:")]
    text = head + EFFECT.replace(old, new)
    path = tmp_path / "twin.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError) as refused:
        load_twin(path)
    assert str(refused.value).startswith(f"{path}: line {line_of(text, new.split(':')[0])}: ")
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        ("kind: push", "kind: pusch", 3, "did you mean push?"),
        ("from_hz", "form_hz", 4, "unknown key form_hz; did you mean from_hz?"),
        ("amplitude: 0.1", "amplitude: x", 5, "expected a number"),
        ("schema: pendulum_plan/1", "schema: plan", 1, "expected pendulum_plan/1"),
    ],
)
def test_a_wrong_phase_has_its_line(
    tmp_path: Path, old: str, new: str, line: int, said: str
) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(PLAN.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInputError) as refused:
        read_plan(path)
    assert str(refused.value).startswith(f"{path}: line {line}: ") and said in str(refused.value)


def test_a_missing_key_has_the_line_of_its_block(tmp_path: Path) -> None:
    path = tmp_path / "twin.yaml"
    text = TWIN[: TWIN.index("effects:")] + "effects:\n  cogging:\n    phase_rad: 0\n"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError, match=f"line {line_of(text, 'cogging')}: effects: cogging"):
        load_twin(path)


@pytest.mark.parametrize(
    ("word", "names", "meant"),
    [
        ("diagnos", ("diagnose", "fit", "replay"), ("diagnose",)),
        ("Repaly", ("diagnose", "fit", "replay"), ("replay",)),
        ("command-lag", ("motor_lag", "command_lag_s"), ("command_lag_s",)),
        ("cart_colomb", ("cart_coulomb", "pole_coulomb"), ("cart_coulomb",)),
        ("cart", ("cart_mass", "cart_drag", "pole_mass"), ("cart_mass", "cart_drag")),
        ("banana", ("diagnose", "fit", "replay"), ()),
        ("", ("diagnose",), ()),
        (3, ("diagnose",), ()),
    ],
)
def test_names_that_are_alike_are_suggested(
    word: object, names: tuple[str, ...], meant: tuple[str, ...]
) -> None:
    assert suggest_names(word, names) == meant

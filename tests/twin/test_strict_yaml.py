"""YAML without its traps: what is read, what is refused and on which line, and nothing hangs."""

import math
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import YAML_MOST_BYTES, read_yaml
from pendulum_twin.model import load_twin
from pendulum_twin.plans.plan_file import load_plan
from pendulum_twin.strict_yaml import format_yaml, parse_yaml

CONFIG = Path(__file__).parents[2] / "config"
TWIN_TEXT = (CONFIG / "inteco.yaml").read_text(encoding="utf-8")
PLAN_TEXT = (CONFIG / "plans" / "chirp.yaml").read_text(encoding="utf-8")
FINITE = st.floats(allow_nan=False, allow_infinity=False)


def read_value(text: str) -> object:
    return parse_yaml(f"key: {text}\n")["key"]


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("5e-05", 5e-5), ("1e-5", 1e-5), ("1.E+5", 1e5), ("+3.", 3.0), (".5", 0.5),
        ("-.5e3", -500.0), ("-1.5E-003", -1.5e-3), ("1.0000e-05", 1e-5), ("12", 12), ("-0", 0),
        ("1E5", 1e5), ("0.50", 0.5), ("1e+22", 1e22),
    ],
)  # fmt: skip
def test_decimal_numbers_are_read(text: str, number: float) -> None:
    assert read_value(text) == number and isinstance(read_value(text), int | float)


@given(FINITE)
def test_every_number_that_python_or_c_prints_is_read(number: float) -> None:
    for text in (repr(number), f"{number:.17g}", f"{number:.16e}", f"{number:+.16E}"):
        assert read_value(text) == number
        assert type(read_value(text)) in (int, float)


@pytest.mark.parametrize(
    "text",
    ["1:30", "0x10", "0o17", "017", "0b11", ".inf", "-.INF", ".nan", "NaN", "Inf", "inf", "1_000",
     "2001-99-99", "2001-01-01", "yes", "on", "1d5", "1,5", "0.5 kg", "'0.5'", "1e", "."],
)  # fmt: skip
def test_what_is_no_decimal_number_is_text(text: str, tmp_path: Path) -> None:
    assert read_value(text) == text.strip("'")
    (tmp_path / "twin.yaml").write_text(TWIN_TEXT.replace("0.5723", text))
    said = r"twin\.yaml: line \d+: cart_mass_kg: expected a number, found"
    with pytest.raises(BadInputError, match=said):
        load_twin(tmp_path / "twin.yaml")


@pytest.mark.parametrize("text", ["true", "False"])
def test_a_boolean_is_no_number(text: str, tmp_path: Path) -> None:
    (tmp_path / "twin.yaml").write_text(TWIN_TEXT.replace("0.5723", text))
    with pytest.raises(
        BadInputError, match=f"cart_mass_kg: expected a number, found {text.title()}"
    ):
        load_twin(tmp_path / "twin.yaml")


def test_a_key_that_stands_twice_is_refused_with_its_name_and_line() -> None:
    with pytest.raises(BadInputError, match="line 3: expected each key once, found a twice"):
        parse_yaml("a: 1\nb: 2\na: 3\n")
    with pytest.raises(BadInputError, match="line 2: expected each key once, found level_n twice"):
        parse_yaml("effects:\n  friction: {level_n: 1, level_n: 2}\n")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a: &x 1\nb: *x\n", "line 1: expected values written out, found the YAML alias or"),
        ("a: 1\nb: *x\n", "line 2: expected values written out, found the YAML alias or anchor x"),
        ("a: 1\nb: !!float 1:30\n", "line 2: expected plain values, found the YAML tag"),
        ("a: !!python/object/apply:os.getcwd []", "line 1: expected plain values, found the YAML"),
        ("[a, b]: 1", "line 1: expected a name as key, found a list or mapping"),
        ("a: 1\n---\na: 2\n", "expected one YAML document, found 2"),
        ("a: 1\nb: [\n", "expected YAML, found on line 3"),
        ("a: 1\n\tb: 2", "expected YAML, found on line 2: found a tab"),
        ("a: \x00", "expected YAML, found"),
        ("a: \ud800", "expected YAML, found"),
        ("[" * 5000, "line 1: expected at most 20 levels of nesting, found more"),
        ("- " * 5000, "line 1: expected at most 20 levels of nesting, found more"),
        ("{a: " * 5000, "line 1: expected at most 20 levels of nesting, found more"),
        ("? " * 5000, "line 1: expected a name as key"),
    ],
)
def test_traps_are_refused(text: str, sentence: str) -> None:
    with pytest.raises(BadInputError) as error:
        parse_yaml(text)
    assert sentence in str(error.value) and len(str(error.value)) < 300


def test_a_bomb_of_aliases_is_refused_where_it_begins(tmp_path: Path) -> None:
    """Sixty lists, each of the one before twice: 2^60 words when written out."""
    lines = ["a0: &a0 [x, x]", *(f"a{k}: &a{k} [*a{k - 1}, *a{k - 1}]" for k in range(1, 60))]
    (tmp_path / "twin.yaml").write_text(TWIN_TEXT + "\n".join(lines))
    with pytest.raises(BadInputError, match=r"line \d+: expected values written out"):
        load_twin(tmp_path / "twin.yaml")


def test_a_large_file_is_refused_unread(tmp_path: Path) -> None:
    file = tmp_path / "twin.yaml"
    with file.open("wb") as stream:
        stream.truncate(1 << 40)  # a terabyte of nothing
    with pytest.raises(
        BadInputError, match="expected a twin file of at most 1 MB, found a larger"
    ):
        read_yaml(file, "a twin file")
    file.write_text("a: " + "x" * (YAML_MOST_BYTES - 3))
    assert len(read_yaml(file, "a twin file")["a"]) == YAML_MOST_BYTES - 3


@pytest.mark.parametrize("content", [b"\xff\xfe", b"a: \xc3"])
def test_other_encodings_are_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "twin.yaml").write_bytes(content)
    with pytest.raises(BadInputError, match=r"expected a twin file, but it cannot be read"):
        load_twin(tmp_path / "twin.yaml")


def test_a_byte_order_mark_is_no_part_of_the_first_key(tmp_path: Path) -> None:
    (tmp_path / "twin.yaml").write_text(TWIN_TEXT, encoding="utf-8-sig")
    assert load_twin(tmp_path / "twin.yaml").name == "inteco"


def test_an_integer_beyond_all_bounds_is_no_finite_number() -> None:
    assert read_value("9" * 10_000) == math.inf


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | FINITE | st.text(st.characters(codec="utf-8")),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text("abc_1e.:0 ~"), inner, max_size=4)
    ),
    max_leaves=12,
)


@settings(deadline=None)
@given(VALUES)
@example({"a": ["1e5", "5e-05", "017", "0x10", "yes", "~", "", "1_000", "-.5e3", "1:30", "null"]})
@example({"1e5": 1, "": 2, "~": 3, "0": 4})
def test_what_is_written_is_read_back(value: object) -> None:
    assert parse_yaml(format_yaml(value)) == value


def test_equal_values_are_written_twice() -> None:
    shared = [1.5, 2.5]
    assert parse_yaml(format_yaml({"a": shared, "b": shared})) == {"a": shared, "b": shared}


PIECES = [
    "&a", "*a", "[", "]", "{", "}", ":", "- ", "\n", "\n  ", "---\n", "? ", "!!int ", "'", '"',
    "|", ">", "#", "%YAML 1.1\n", "<<: ", "\t", "\x00", "\ud7ff", "2001-99-99", "1e999", ".nan",
    "true", "9" * 400, "schema: pendulum_twin/1\n", "phases: ", "kind: chirp", "[[" * 50,
    "\\ud800", "~",
]  # fmt: skip


@st.composite
def draw_damage(draw: st.DrawFn, text: str) -> str:
    """Return a good file with pieces of it replaced, put in twice or cut."""
    for _ in range(draw(st.integers(1, 4))):
        begin = draw(st.integers(0, len(text)))
        end = min(len(text), begin + draw(st.integers(0, 30)))
        other = draw(st.sampled_from(PIECES) | st.text(max_size=8) | st.just(text[begin:end] * 2))
        text = text[:begin] + other + text[end:]
    return text


@settings(deadline=None, max_examples=100)
@given(draw_damage(TWIN_TEXT))
def test_a_damaged_twin_file_is_read_or_refused(tmp_path_factory, text: str) -> None:
    check_answer(load_twin, tmp_path_factory.mktemp("damaged") / "twin.yaml", text)


@settings(deadline=None, max_examples=100)
@given(draw_damage(PLAN_TEXT))
def test_a_damaged_plan_file_is_read_or_refused(tmp_path_factory, text: str) -> None:
    check_answer(load_plan, tmp_path_factory.mktemp("damaged") / "plan.yaml", text)


def check_answer(load, path: Path, text: str) -> None:
    """Check that a loader answers, or refuses in a sentence with the path."""
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    try:
        load(path)
    except BadInputError as error:
        assert str(error).startswith(f"{path}: ") and len(str(error)) < 2000

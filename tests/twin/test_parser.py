"""Command lines are alike: defaults and examples in the help, hints in what is refused."""

import argparse

import pytest

from pendulum_twin.parser import Parser, add_common_options
from pendulum_twin.version import __version__


def make_parser() -> Parser:
    parser = Parser(
        prog="tool", description="Do it.\n\nAs follows:\n  one\n  two", examples=("tool go",)
    )
    add_common_options(parser)
    verbs = parser.add_subparsers(dest="verb", required=True)
    go = verbs.add_parser("go", examples=("tool go --speed 3",))
    add_common_options(go, argparse.SUPPRESS)
    go.add_argument("--speed", type=float, default=0, help="of the cart, m/s")
    go.add_argument("--gentle", action="store_true", help="no jerks")
    go.add_argument("--rate", type=int, default=100, help="in Hz (default: %(default)d)")
    go.add_argument("--zero", choices=("up", "down"), default="up")
    go.add_argument("--kind", choices=("chirp", "steps"), help="of signal")
    verbs.add_parser("rest", examples=("tool rest",))
    return parser


def refuse(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args(line.split())
    assert ended.value.code == 2
    return capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("rset", "did you mean rest?"),
        ("go --sped 3", "did you mean --speed?"),
        ("go --speeed=3", "did you mean --speed?"),
        ("go --zero dwon", "did you mean down?"),
        ("go --kind stepps", "did you mean steps?"),
        ("--quite go", "did you mean --quiet?"),
        ("go --s-peed 3", "did you mean --speed?"),
    ],
)
def test_a_misspelt_word_is_refused_with_the_word_that_was_meant(
    line: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refuse(line, capsys).endswith(hint)


@pytest.mark.parametrize("line", ["go --banana", "xyz", "go --zero 7"])
def test_nothing_is_suggested_for_what_is_like_nothing(
    line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "did you mean" not in refuse(line, capsys)


def test_right_use_is_parsed_as_argparse_does() -> None:
    options = make_parser().parse_args(["--quiet", "go", "--spe=3", "--zero", "down"])
    assert (options.quiet, options.verb, options.speed, options.zero) == (True, "go", 3.0, "down")
    assert make_parser().parse_args(["go", "--quiet"]).quiet
    assert not make_parser().parse_args(["go"]).quiet


def print_help(line: str, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as ended:
        make_parser().parse_args(line.split())
    assert ended.value.code == 0
    return capsys.readouterr().out


def test_help_shows_defaults_that_say_something_once(capsys: pytest.CaptureFixture[str]) -> None:
    said = " ".join(print_help("go --help", capsys).split())
    assert "of the cart, m/s (default: 0)" in said
    assert "in Hz (default: 100)" in said and said.count("100") == 1
    assert "no jerks --rate" in said and said.endswith("of signal examples: tool go --speed 3")


def test_help_ends_in_examples_and_keeps_indented_lines(
    capsys: pytest.CaptureFixture[str],
) -> None:
    said = print_help("--help", capsys)
    assert said.endswith("examples:\n  tool go\n")
    assert "Do it.\n\nAs follows:\n  one\n  two\n" in said


@pytest.mark.parametrize(("line", "name"), [("--version", "tool"), ("go --version", "tool go")])
def test_every_verb_says_its_version(
    line: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert print_help(line, capsys) == f"{name} {__version__}\n"

"""The public API: its examples, every kind of input, and a package that loads nothing at once."""

import doctest
import inspect
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO, made, made_bag
from support.paths import ROOT, SRC

import pendulum_sysid as ps
from pendulum_sysid.api import make_recording
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin


def list_examples() -> Iterator[tuple[str, str]]:
    """Yield names and docstrings: the package first, whose names the others go on from."""
    yield "pendulum_sysid", inspect.getdoc(ps) or ""
    for name in ps.__all__:
        member = getattr(ps, name)
        if (getattr(member, "__module__", "") or "").startswith("pendulum_sysid"):
            yield name, inspect.getdoc(member) or ""
    yield "Recording.from_arrays", inspect.getdoc(ps.Recording.from_arrays) or ""


def test_the_examples_of_the_docstrings_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {}
    parser = doctest.DocTestParser()
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    examples = dict(list_examples())
    order = ["pendulum_sysid", "fit", *(name for name in examples if name != "fit")]
    for name in dict.fromkeys(order):
        test = parser.get_doctest(examples[name], names, name, None, 0)
        runner = doctest.DocTestRunner(optionflags=flags, verbose=False)
        text: list[str] = []
        runner.run(test, out=text.append, clear_globs=False)
        assert not runner.failures, f"{name}:\n{''.join(text)}"
        names |= test.globs


def test_every_public_function_has_an_example() -> None:
    for name in ("compare", "diagnose", "fit", "read_recording", "replay", "simulate"):
        assert ">>> " in (inspect.getdoc(getattr(ps, name)) or ""), name


def test_the_package_imports_nothing_until_a_name_is_used() -> None:
    code = (
        "import sys, pendulum_sysid as ps; assert 'numpy' not in sys.modules; "
        "assert 'diagnose' in dir(ps); ps.Recording; assert 'pendulum_sysid.pipeline' not in "
        "sys.modules and 'matplotlib' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        ps.nothing  # noqa: B018


def test_the_version_is_that_of_the_package_and_types_are_shipped() -> None:
    package = SRC / "pendulum_sysid"
    assert f'version="{ps.__version__}"' in (package / "setup.py").read_text()
    assert '"py.typed"' in (package / "setup.py").read_text()
    assert (package / "pendulum_sysid" / "py.typed").exists()


def test_a_bag_a_frame_a_mapping_and_a_list_hold_the_same(tmp_path: Path) -> None:
    recording = made(INTECO, 12.0)
    signals = recording.signals
    columns = {
        "t": np.arange(len(signals)) * signals.period_s,
        "command": signals.command,
        "cart": signals.cart,
        "pole": signals.pole,
    }
    bag = made_bag(tmp_path / "bag", recording)
    sources = [bag, str(bag), pd.DataFrame(columns), columns, [recording]]
    scores = [ps.replay(source, INTECO).score for source in sources]
    assert scores == pytest.approx([scores[0]] * len(scores), rel=1e-3)


def test_a_joint_that_is_not_recorded_may_be_none() -> None:
    signals = made(INTECO, 12.0).signals
    t = pd.Series(np.arange(len(signals)) * signals.period_s)
    recording = ps.Recording.from_arrays(t, signals.command, signals.cart, None)
    assert recording.signals.pole is None and len(recording.signals) == len(signals)
    assert recording.digest.startswith("sha256:")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cart": np.zeros(3)}, r"expected cart with the shape of t, \(1200,\), found \(3,\)"),
        ({"cart": None, "pole": None}, "found neither"),
        ({"t": 1.0}, r"expected t with one dimension, found an array of shape \(\)"),
        ({"t": np.zeros((1200, 1))}, r"expected t with one dimension, .* \(1200, 1\)"),
        ({"t": ["noon"] * 1200}, "expected t to be numbers, found .*noon"),
        ({"pole": [None, "up"] * 600}, "expected pole to be numbers, found .*up"),
        ({"t": np.arange(1200).astype("datetime64[ms]")}, "expected t to be numbers.*seconds"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change: dict, message: str) -> None:
    signals = made(INTECO, 12.0).signals
    arrays = {
        "t": np.arange(len(signals)) * signals.period_s,
        "command": signals.command,
        "cart": signals.cart,
        "pole": signals.pole,
    }
    with pytest.raises(BadInputError, match=message):
        make_recording(**(arrays | change))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_time_that_is_not_finite_is_refused_with_its_place(bad: float) -> None:
    t = 0.01 * np.arange(400)
    command, cart = np.sin(t), np.cos(t)
    for places, message in (([7, 9], "found 2 of 400 .* at sample 7"), ([0], "at sample 0")):
        broken = t.copy()
        broken[places] = bad
        with pytest.raises(BadInputError, match=f"expected finite sampling times, .*{message}"):
            make_recording(broken, command, cart, None)


def test_no_recording_at_all_is_refused() -> None:
    for call in (ps.diagnose, ps.fit, ps.replay):
        with pytest.raises(BadInputError, match="expected at least one recording, found none"):
            call([], INTECO)


def test_a_constant_that_is_known_may_be_given_as_its_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A text is a sequence of letters: it was refused for its first letter."""
    twins: list[Twin] = []
    monkeypatch.setattr("pendulum_sysid.pipeline.diagnose", lambda _, twin, __: twins.append(twin))
    names = "force_per_pwm_n", "pole_viscous_n_m_s"
    for hold in (names[0], [names[0]], names):
        ps.diagnose(made(INTECO, 3.0), INTECO, hold=hold)
    assert [dict(twin.spreads) for twin in twins] == [
        dict.fromkeys(held, 0.0) for held in (names[:1], names[:1], names)
    ]
    with pytest.raises(BadInputError, match="found 'gravity'"):
        ps.diagnose(made(INTECO, 3.0), INTECO, hold="gravity")


def test_a_frame_without_times_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected a column t"):
        ps.replay(pd.DataFrame({"cart": [0.0]}), INTECO)


@pytest.fixture(scope="module")
def verdict() -> ps.Verdict:
    recording, _ = record_hidden({"cart_coulomb_friction": {"level_n": 0.5}}, 5, 24.0)
    return ps.diagnose(recording, INTECO)


def test_a_verdict_shows_itself_in_a_notebook(verdict: ps.Verdict) -> None:
    html = verdict._repr_html_()
    assert verdict.outcome is ps.Outcome.NAMED and "<strong>named</strong>" in html
    (missing,) = verdict.missing_physics
    assert missing.effect in html and html.count("<table>") == html.count("</table>") == 2


def test_a_verdict_draws_its_runs_and_the_missing_shape(
    verdict: ps.Verdict, tmp_path: Path
) -> None:
    figure = verdict.plot()
    assert len(figure.axes) == 3 * 3
    figure.savefig(tmp_path / "verdict.png")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert "cart (m)" in labels and "pole (rad)" in labels
    read = ps.Verdict.from_dict(verdict.to_dict())
    assert read == verdict and not read.plot().axes


def test_the_improved_twin_runs_better(verdict: ps.Verdict) -> None:
    recording, _ = record_hidden({"cart_coulomb_friction": {"level_n": 0.5}}, 5, 24.0)
    assert verdict.twin is not None
    pair = ps.compare(recording, INTECO, verdict.twin)
    assert pair.second_better > 0.8 * pair.comparisons[0].count


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("outcome", "perhaps", "verdict.outcome: expected Outcome, found 'perhaps'"),
        ("sentence", None, "verdict.sentence: expected str, found None"),
        (
            "missing_physics",
            [{}],
            r"verdict.missing_physics\[0\]: expected effect, found it missing",
        ),
        ("recording", [], "verdict.recording: expected a mapping"),
        ("schema", "pendulum_twin/1", "expected a verdict with schema pendulum_verdict/1"),
    ],
)
def test_a_file_that_holds_no_verdict_is_refused(
    verdict: ps.Verdict, key: str, value: object, message: str
) -> None:
    with pytest.raises(BadInputError, match=message):
        ps.Verdict.from_dict({**verdict.to_dict(), key: value})

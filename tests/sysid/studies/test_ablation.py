"""The study of the decisions: every number is listed, replaced while it runs, and put back."""

from pathlib import Path

import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.paths import ROOT

from pendulum_sysid import decisions
from pendulum_sysid.studies.ablation import trial_verdict
from pendulum_sysid.studies.ablation.__main__ import main as ablation
from pendulum_sysid.studies.ablation.decision_list import Decision, Value, list_decisions
from pendulum_sysid.studies.ablation.memory import Memory
from pendulum_sysid.studies.ablation.table import (
    BEGIN,
    END,
    list_idle,
    render_tables,
    write_page,
)
from pendulum_sysid.studies.ablation.variation import (
    AS_IT_IS,
    Tried,
    read_tried,
    replace_decision,
    vary_decisions,
)
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import save_twin


def make_decision(name: str, value: Value, unit: str = "s") -> Decision:
    return Decision(name, "A question?", value, unit, "a reason")


def test_every_decision_is_listed_with_question_unit_and_reason() -> None:
    listed = list_decisions()
    names = [decision.name for decision in listed]
    assert names == [name for name in vars(decisions) if name.isupper()]
    assert all(decision.question.endswith("?") for decision in listed)
    assert all(decision.unit and decision.why for decision in listed)


def test_variants_go_up_and_down_and_rules_off() -> None:
    assert make_decision("A", 2.0).variants == {"up": 3.0, "down": pytest.approx(2.0 / 1.5)}
    assert make_decision("A", 1).variants == {"up": 2, "down": 1}
    assert make_decision("A", 5).variants == {"up": 8, "down": 3}
    assert make_decision("A", 1.2, "ratio").variants["up"] == pytest.approx(1.3)
    assert make_decision("A", 0.9, "of samples").variants["up"] == 1.0
    assert make_decision("A", True, "on or off").variants == {"off": False}


def test_several_numbers_are_varied_together() -> None:
    pair = make_decision("A", (0.25, 0.9), "quantiles of commands")
    assert pair.variants["up"] == (pytest.approx(0.375), 1.0) and pair.words == "0.25, 0.9"
    assert all(decision.variants and decision.words for decision in list_decisions())


def test_a_decision_is_put_back() -> None:
    plain = decisions.LEAD_STANDARD_ERRORS
    with pytest.raises(KeyError), replace_decision("LEAD_STANDARD_ERRORS", 99.0):
        assert decisions.LEAD_STANDARD_ERRORS == 99.0
        raise KeyError
    assert plain == decisions.LEAD_STANDARD_ERRORS


def test_a_result_is_remembered_until_a_decision_that_it_read_changes() -> None:
    calls: list[float] = []

    def double(x: float) -> float:
        calls.append(x)
        return 2.0 * x * decisions.LEAD_STANDARD_ERRORS

    memory = Memory()
    remembered = memory.wrap(double, lambda x: x)
    with memory.trace():
        first = remembered(1.0)
        with memory.watch() as reads:
            assert remembered(1.0) == first
        assert reads == {"LEAD_STANDARD_ERRORS": decisions.LEAD_STANDARD_ERRORS}
        with replace_decision("LEAD_MISFIT_RATIO", 9.0):
            assert remembered(1.0) == first
        assert calls == [1.0]
        with replace_decision("LEAD_STANDARD_ERRORS", 3.0):
            assert remembered(1.0) == 6.0
        assert remembered(2.0) == 2.0 * first
    assert calls == [1.0, 1.0, 2.0]


def test_a_trial_s_verdicts_are_kept_and_not_tried_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording, _ = record_hidden({"rail_tilt": HIDDEN["rail_tilt"]}, 1, 20.0)
    monkeypatch.setattr(trial_verdict, "read_bag", lambda folder: None)
    monkeypatch.setattr(trial_verdict, "clean_recording", lambda raw: recording)
    folder, kept = tmp_path / "trial_0000", tmp_path / "kept.jsonl"
    (folder / "bag").mkdir(parents=True)
    (folder / "bag" / "bag.mcap").write_text("a recording")
    save_twin(INTECO, folder / "twin.yaml")
    wanted = ("LEAD_MISFIT_RATIO", "LONGEST_FILL", "CHECK_SHAPES")
    chosen = [decision for decision in list_decisions() if decision.name in wanted]
    vary_decisions(folder, chosen, kept)
    tried = read_tried(kept)
    assert tried[0].variant == AS_IT_IS and tried[0].names == ("rail_tilt",)
    assert [t.variant for t in tried[1:]] == ["up", "down", "up", "down", "off"]
    assert {t.decision for t in tried if not t.read} == {"LONGEST_FILL"}
    vary_decisions(folder, chosen, kept)
    assert read_tried(kept) == tried
    (folder / "bag" / "bag.mcap").write_text("another recording of this name")
    with pytest.raises(BadInputError, match="tries of another recording or twin"):
        vary_decisions(folder, chosen, kept)
    kept.write_text("".join(line.split(', "digest"')[0] + "}\n" for line in kept.open()))
    vary_decisions(folder, chosen, kept)  # of a file that does not say


def test_a_folder_without_trials_is_refused_in_a_sentence(tmp_path: Path, capsys) -> None:
    words = ["--trials", str(tmp_path), "--out", str(tmp_path / "page.md"), "--numbers", "1"]
    assert ablation(["--kept", str(tmp_path / "kept.jsonl"), "--processes", "1", *words]) == 1
    assert "trial_0001: expected a trial with its recording" in capsys.readouterr().err


def test_the_table_counts_the_verdicts_that_change() -> None:
    chosen = [
        make_decision("FIRST", 2.0),
        make_decision("SECOND", True),
        make_decision("NEVER", 3),
    ]
    tried = [
        Tried("t0", "", AS_IT_IS, "named", ("motor_lag",), True),
        Tried("t0", "FIRST", "up", "nothing_missing", (), True),
        Tried("t0", "FIRST", "down", "named", ("motor_lag",), True),
        Tried("t0", "SECOND", "off", "named", ("motor_lag",), True),
        Tried("t0", "NEVER", "up", "named", ("motor_lag",), False),
    ]
    page = render_tables(chosen, tried)
    assert "| `FIRST` | 2 | s | a reason | 1 | 0 |" in page
    assert "| `SECOND` | on | s | a reason | 0 | - |" in page
    assert "| `NEVER` | 3 | s | a reason | - | - |" in page
    assert "| `FIRST` up | t0 | named: motor_lag | nothing_missing |" in page
    assert list_idle(chosen, tried) == ["SECOND"]


def test_the_page_has_every_decision_as_it_is() -> None:
    """After a change of `decisions.py` its row changes, too: by hand, or by `make ablate`."""
    page = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    tables = page.split(BEGIN)[1].split("## What changed")[0]
    question, rows = "", []
    for line in tables.splitlines():
        question = line[3:] if line.startswith("## ") else question
        if line.startswith("| `"):
            rows.append((question, *line.strip("| ").split(" | ")[:4]))
    assert rows == [(d.question, f"`{d.name}`", d.words, d.unit, d.why) for d in list_decisions()]


def test_writing_the_tables_keeps_what_stands_around_them(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"# Decisions\n\nBy hand.\n\n{BEGIN}old tables\n{END}\nBelow.\n")
    write_page(page, "new tables\n")
    assert page.read_text() == (f"# Decisions\n\nBy hand.\n\n{BEGIN}new tables\n{END}\nBelow.\n")
    write_page(tmp_path / "fresh.md", "new tables\n")
    assert (tmp_path / "fresh.md").read_text() == f"# Decisions\n\n{BEGIN}new tables\n{END}"


def test_a_page_without_marks_is_not_overwritten(tmp_path: Path, capsys) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Notes\n")
    words = ["--trials", str(tmp_path), "--out", str(page), "--numbers", "1", "--processes", "1"]
    assert ablation(["--kept", str(tmp_path / "kept.jsonl"), *words]) == 1
    assert "expected the marks" in capsys.readouterr().err
    assert page.read_text() == "# Notes\n"

"""Every program in docs/, and those that only `python -m` starts: --help, and wrong use."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.paths import ROOT, SRC

DOCS = ROOT / "docs"
MAIN = 'if __name__ == "__main__":'
PROGRAMS = sorted(path for path in DOCS.glob("*.py") if MAIN in path.read_text(encoding="utf-8"))
MODULES = [  # those that tests/test_help.py does not ask
    SRC / "pendulum_sysid" / "pendulum_sysid" / "studies" / "stage_shares.py",
    SRC / "pendulum_twin" / "pendulum_twin" / "compile_ahead.py",
    ROOT / "tests" / "house.py",
]
WITHOUT_WORDS = ("draw_rooms", "draw_signatures", "compile_ahead", "house")  # need no argument
# All in one process, for many of them import the same libraries for seconds.
RUNNER = """
import contextlib, io, json, runpy, sys, traceback
docs, words, files = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3:]
sys.path.insert(0, docs)
ended = {}
for file in files:
    sys.argv = [file, *words]
    out, err, status = io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            runpy.run_path(file, run_name="__main__")
        except SystemExit as end:
            status = end.code or 0
        except BaseException:
            status = "Traceback: " + traceback.format_exc()[-500:]
    ended[file] = [status, out.getvalue(), err.getvalue()]
print(json.dumps(ended))
"""
Ends = dict[str, tuple[int | str, str, str]]  # program -> status, stdout, stderr


def run_all(words: list[str], where: Path, files: list[Path]) -> Ends:
    """Run programs with the same words; return how each ends."""
    call = [sys.executable, "-c", RUNNER, str(DOCS), json.dumps(words), *map(str, files)]
    done = subprocess.run(
        call,
        cwd=where,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {Path(file).stem: tuple(end) for file, end in json.loads(done.stdout).items()}


def list_files(folder: Path) -> dict[str, int]:
    """Return every file below a folder with the time of its last change."""
    paths = (path for path in folder.rglob("*") if "__pycache__" not in path.parts)
    return {str(path): path.stat().st_mtime_ns for path in paths}


@pytest.mark.long
def test_help_is_answered_and_nothing_is_done(tmp_path: Path) -> None:
    before = list_files(DOCS)
    ends = run_all(["--help"], tmp_path, [*PROGRAMS, *MODULES])
    assert len(ends) > 12
    assert {name: end for name, (end, _, _) in ends.items() if end != 0} == {}
    for name, (_, said, _) in ends.items():
        assert said.startswith("usage: ") and name in said.splitlines()[0], said
        assert name in ("own_rig", "screenshots", "house") or "\nexamples:\n  " in said, name
    assert [*tmp_path.iterdir()] == []
    assert list_files(DOCS) == before


@pytest.mark.parametrize("words", [["--no-such-option"], []], ids=["an option", "nothing"])
def test_wrong_use_ends_in_a_sentence(words: list[str], tmp_path: Path) -> None:
    files = [path for path in [*PROGRAMS, *MODULES] if words or path.stem not in WITHOUT_WORDS]
    before = list_files(DOCS)
    ends = run_all(words, tmp_path, files)
    assert {name: end for name, (end, _, _) in ends.items() if end != 2} == {}
    for name, (_, said, complaint) in ends.items():
        assert said == "" and ": error: " in complaint.splitlines()[-1], name
    assert [*tmp_path.iterdir()] == []
    assert list_files(DOCS) == before


def test_inputs_that_are_missing_end_in_a_sentence(tmp_path: Path) -> None:
    """Also behind the command line: a bag, a twin or a folder that is not there."""
    names = {path.stem: path for path in [*PROGRAMS, *MODULES]}
    given = {
        "cut_recording": ["no_bag", "out", "0", "1"],
        "rotate_split": ["no_bag", "no_twin"],
        "stage_shares": ["no_trial"],
        "study_injected": ["no_rigs", "out"],
        "study_latent_force": ["no_proof"],
        "study_real_rigs": ["no_rigs", "out"],
        "screenshots": ["--report", "no_report.html", "--out", "out"],
    }
    for name, words in given.items():
        status, said, complaint = run_all(words, tmp_path, [names[name]])[name]
        assert status in (1, 2), (name, status)
        assert said == "" and complaint.splitlines()[-1].startswith(name), (name, complaint)
    assert [*tmp_path.iterdir()] == []

"""A new answer replaces an old one whole; whatever goes wrong between leaves the old one."""

from pathlib import Path

import pytest

from pendulum_sysid.telling import folder_swap
from pendulum_sysid.telling.folder_swap import replace_files

NAMES = ("verdict.json", "report.html", "twin.yaml")


def write(folder: Path, content: str, names: tuple[str, ...] = NAMES) -> None:
    with replace_files(folder, NAMES) as new:
        for name in names:
            (new / name).write_text(content)


def read(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.is_file()}


def test_the_new_answer_replaces_the_old(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    write(out, "old")
    write(out, "new", NAMES[:2])
    assert read(out) == {"verdict.json": "new", "report.html": "new"}
    assert [path.name for path in out.parent.iterdir()] == ["out"]


def test_other_files_stay(tmp_path: Path) -> None:
    write(tmp_path, "old")
    (tmp_path / "notes.txt").write_text("mine")
    write(tmp_path, "new", NAMES[:1])
    assert read(tmp_path) == {"verdict.json": "new", "notes.txt": "mine"}


@pytest.mark.parametrize("others", [False, True])
@pytest.mark.parametrize("killed_in", ["body", "_replace_folder", "_move_files"])
def test_killed_while_writing_never_mixes_two_answers(
    tmp_path: Path, killed_in: str, others: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kill is an exception here that nothing of the code catches."""
    out = tmp_path / "out"
    write(out, "old")
    if others:
        (out / "notes.txt").write_text("mine")

    def die(*_: object) -> bool:
        raise KeyboardInterrupt

    if killed_in == "body":
        with pytest.raises(KeyboardInterrupt), replace_files(out, NAMES) as new:
            (new / NAMES[0]).write_text("new")
            die()
    else:
        monkeypatch.setattr(folder_swap, killed_in, die)
        if others == (killed_in == "_move_files"):
            with pytest.raises(KeyboardInterrupt):
                write(out, "new")
        else:
            write(out, "new")
    content = {name: text for name, text in read(out).items() if name in NAMES}
    assert set(content.values()) in ({"old"}, {"new"}) and len(content) == 3


@pytest.mark.parametrize("step", range(3))
def test_the_chief_file_stands_beside_its_own_answer_only(
    tmp_path: Path, step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where files are exchanged one by one, each step leaves an answer without its chief file."""
    write(tmp_path, "old")
    (tmp_path / "notes.txt").write_text("mine")
    replace, steps = Path.replace, iter(range(9))

    def replace_or_die(self: Path, target: Path) -> Path:
        if next(steps) == step:
            raise KeyboardInterrupt
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", replace_or_die)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path, "new")
    assert "verdict.json" not in read(tmp_path)


def test_a_folder_in_which_somebody_stands_is_not_replace_folderd(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, "old")
    monkeypatch.chdir(tmp_path)
    before = tmp_path.stat().st_ino
    write(Path(), "new")
    assert tmp_path.stat().st_ino == before and set(read(tmp_path).values()) == {"new"}

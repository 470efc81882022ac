"""Completion by argcomplete, in a bash and a zsh as a user's: verbs, options, choices, files."""

import os
import pty
import select
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

import pytest
from support.paths import ROOT
from support.programs import list_executables

EXECUTABLES = list_executables()
REGISTER = Path(sys.executable).with_name("register-python-argcomplete")
SOURCES = os.pathsep.join(str(path) for path in sorted(ROOT.glob("src/pendulum_*")))
MODULES = {name: EXECUTABLES[name] for name in ("sysid", "train", "rig_doctor")}
COMPLETE = """
eval "$({register} {names})"
COMP_LINE={line!r} COMP_POINT=${{#COMP_LINE}} COMP_TYPE=9
COMP_WORDS=({line}) COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
{empty}
function=$(complete -p {name} | sed -E 's/.* -F ([^ ]+) .*/\\1/')
"$function" {name} "${{COMP_WORDS[COMP_CWORD]}}" "${{COMP_WORDS[COMP_CWORD-1]}}" 2>/dev/null
printf '%s\\n' "${{COMPREPLY[@]}}"
"""

# In zsh a tab completes the line of an editor, which needs a terminal; Ctrl-X prints the line.
ZSH = """
autoload -U compinit && compinit -u -d dump
eval "$({register} {names})"
show() {{ print -r -- "<$BUFFER>"; BUFFER= }}
zle -N show; bindkey '^X' show; LISTMAX=999
stty -echo; print rea""dy
"""
DEADLINE_S = 120.0

pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the programs of this source tree, as `make setup` installs them."""
    folder = tmp_path_factory.mktemp("bin")
    for name, entry in MODULES.items():
        module, function = entry.split(":")
        program = folder / name
        program.write_text(
            f"#!{sys.executable}\nimport sys\nsys.path[:0] = {SOURCES.split(os.pathsep)!r}\n"
            f"from {module} import {function}\nsys.exit({function}())\n"
        )
        program.chmod(0o755)
    return folder


def complete(line: str, programs: Path, where: Path) -> set[str]:
    """Return what bash offers after a line, of which the last word is begun."""
    name = line.split()[0]
    script = COMPLETE.format(
        register=REGISTER,
        names=" ".join(MODULES),
        line=line,
        name=name,
        empty="COMP_WORDS+=('') COMP_CWORD=$((COMP_CWORD + 1))" if line.endswith(" ") else "",
    )
    environment = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "--norc", "-c", script],
        cwd=where,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {word.strip() for word in done.stdout.splitlines() if word.strip()}


def test_verbs_and_options_are_completed(programs: Path, tmp_path: Path) -> None:
    assert complete("sysid re", programs, tmp_path) == {"replay"}
    assert complete("sysid fleet ", programs, tmp_path) >= {"run", "history", "compare", "page"}
    assert complete("sysid diagnose run --ho", programs, tmp_path) == {"--hold"}
    assert complete("sysid import a.csv --pole-zero ", programs, tmp_path) == {"up", "down"}


def test_files_and_names_are_completed(programs: Path, tmp_path: Path) -> None:
    (tmp_path / "rig.yaml").write_text("")
    (tmp_path / "run").mkdir()
    assert complete("sysid replay run --twin ri", programs, tmp_path) == {"rig.yaml"}
    assert complete("sysid replay ru", programs, tmp_path) == {"run/"}
    offered = complete("sysid fit run --hold pole_i", programs, tmp_path)
    assert offered == {"pole_inertia_kg_m2"}


def test_other_programs_complete_without_torch(programs: Path, tmp_path: Path) -> None:
    assert complete("train --preset f", programs, tmp_path) >= {"fast", "frugal"}
    assert complete("rig_doctor --mo", programs, tmp_path) == {"--move"}


@contextmanager
def opened_zsh(programs: Path, where: Path) -> Iterator[int]:
    """Run a zsh with the documented line; yield its terminal once it takes commands."""
    terminal, its_end = pty.openpty()
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "TERM": "dumb", "COLUMNS": "160", "LINES": "99"}
    shell = subprocess.Popen(
        ["zsh", "-f", "-i"], cwd=where, env=environment, start_new_session=True,
        stdin=its_end, stdout=its_end, stderr=its_end,
    )  # fmt: skip
    os.close(its_end)
    try:
        os.write(terminal, ZSH.format(register=REGISTER, names=" ".join(MODULES)).encode())
        read_until("ready\r\n", terminal)
        yield terminal
    finally:
        shell.kill()
        shell.wait()
        os.close(terminal)


def read_until(end: str, terminal: int) -> str:
    """Return what a terminal shows, up to an ending."""
    text, deadline = "", monotonic() + DEADLINE_S
    while not text.endswith(end):
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - monotonic()))
        assert ready, text
        text += os.read(terminal, 1).decode(errors="replace")
    return text


def press_tab(line: str, terminal: int) -> tuple[str, set[str]]:
    """Return the line after a tab, and the words that are offered below it."""
    os.write(terminal, f"{line}\t\x18".encode())
    shown = read_until(">\r\n", terminal)
    listed = shown.replace("\r", "").split("\n")[1:-2]
    words = {word for row in listed for word in row.partition(" -- ")[0].split()}
    return shown.rpartition("<")[2].removesuffix(">\r\n"), words


@pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh")
def test_zsh_completes_the_same(programs: Path, tmp_path: Path) -> None:
    (tmp_path / "rig.yaml").write_text("")
    with opened_zsh(programs, tmp_path) as terminal:
        assert press_tab("sysid re", terminal) == ("sysid replay ", set())
        line, offered = press_tab("sysid fleet ", terminal)
        assert line == "sysid fleet " and offered >= {"run", "history", "compare", "page"}
        assert press_tab("sysid import a.csv --pole-zero ", terminal)[1] >= {"up", "down"}
        for begun, whole in (
            ("sysid diagnose run --ho", "sysid diagnose run --hold "),
            ("sysid replay run --twin ri", "sysid replay run --twin rig.yaml "),
            ("sysid fit run --hold pole_i", "sysid fit run --hold pole_inertia_kg_m2 "),
            ("rig_doctor --mo", "rig_doctor --move "),
        ):
            assert press_tab(begun, terminal) == (whole, set())


def test_the_documented_line_names_every_program() -> None:
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    (line,) = [line for line in page.splitlines() if "register-python-argcomplete" in line]
    assert set(EXECUTABLES) <= set(line.replace(")", " ").split())

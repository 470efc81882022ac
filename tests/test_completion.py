"""Completion by argcomplete, in a real bash as a user's: verbs, options, choices, files."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

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


def test_the_documented_line_names_every_program() -> None:
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    (line,) = [line for line in page.splitlines() if "register-python-argcomplete" in line]
    assert set(EXECUTABLES) <= set(line.replace(")", " ").split())

"""The documentation is right: commands parse, links lead somewhere, effects and files exist."""

import os
import re
import shlex
import subprocess
import sys
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest
from support.made_recordings import INTECO, made, made_bag
from support.paths import ROOT
from test_architecture import FLOORS

from pendulum_bridge.emulator.conceal import draw_concealed
from pendulum_sysid.cli import MODULES
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.verbs.options import make_parser
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect, Parameter
from pendulum_twin.model import load_twin

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
README = (ROOT / "README.md").read_text(encoding="utf-8")
VERBS = "Verbs of `sysid`"
REAL_RIGS = (ROOT / "docs" / "real_rigs.md").read_text(encoding="utf-8")


def shell_lines(text: str) -> list[str]:
    return [
        line
        for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        for line in block.splitlines()
    ]


def sysid_calls(text: str) -> list[list[str]]:
    """Return the arguments of every call of `sysid` in the shell blocks, loops taken apart."""
    parts = (part.strip() for line in shell_lines(text) for part in re.split(r";|&&", line))
    words = [shlex.split(part.removeprefix("do ")) for part in parts if part]
    return [each[1:] for each in words if each and each[0].endswith("bin/sysid")]


def section(text: str, title: str) -> str:
    return text.split(f"\n## {title}\n")[1].split("\n## ")[0]


def run(command: str, where: Path) -> None:
    shell = ["bash", "-euo", "pipefail", "-c", command]
    done = subprocess.run(
        shell, cwd=where, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, (
        f"{command}\nended with {done.returncode}\n{done.stdout}\n{done.stderr}"
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_calls_of_sysid_are_right_use(page: Path) -> None:
    for arguments in sysid_calls(page.read_text(encoding="utf-8")):
        make_parser().parse_args(arguments)  # ends with SystemExit when it is not


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8"))
    assert [
        link for link in links if "://" not in link and not (page.parent / link).exists()
    ] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_prose_stays_within_99_columns(page: Path) -> None:
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    free = ("|", "![")  # rows of tables and pictures cannot be broken
    lines = [line for line in prose.splitlines() if not line.lstrip().startswith(free)]
    assert [line for line in lines if len(line) > 99] == []


def test_the_readme_lists_the_catalogue() -> None:
    assert set(re.findall(r"`(\w+)`", section(README, "The catalogue"))) - {"CATALOGUE"} == set(
        BY_NAME
    )


def test_contributing_names_every_field_that_an_effect_may_leave_out() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`[^`\n]+`", text))))
    left_out = {
        field.name
        for kind in (Effect, Parameter)
        for field in fields(kind)
        if field.default is not MISSING
    }
    assert left_out - words == set()


def test_the_demo_of_the_readme_shows_what_its_seed_conceals() -> None:
    """A catalogue that grows may draw other physics from the seed: run the demo again then."""
    calls = r"make demo ARGS=\"--seed (\d+) --effects (\d+)\""
    (said,) = {(int(seed), int(count)) for seed, count in re.findall(calls, README)}
    concealed = draw_concealed(*said, INTECO.rig, live=True).effects
    table = README.split("concealed              found")[1].split("\n...")[0]
    assert re.findall(r"^  (\w+): named$", table, re.MULTILINE) == list(concealed)
    sizes = {key: f"{size:.4g}" for sizes in concealed.values() for key, size in sizes.items()}
    shown = dict(re.findall(r"^    (\w+) +(\S+)", table, re.MULTILINE))
    assert shown and shown.items() <= sizes.items()


@pytest.mark.parametrize(
    "file", sorted((ROOT / "config").glob("*.yaml")), ids=lambda file: file.stem
)
def test_twin_files_load_and_bear_their_name(file: Path) -> None:
    assert load_twin(file).name == file.stem


def test_the_order_of_rooms_is_that_of_the_rules() -> None:
    design = (ROOT / "DESIGN.md").read_text(encoding="utf-8")
    order = re.search(r"`(\w+(?:\s<\s\w+)+)`", design)
    assert order is not None and tuple(re.split(r"\s<\s", order[1])) == FLOORS


def test_the_drawing_of_rooms_is_current() -> None:
    check = [sys.executable, str(ROOT / "docs" / "draw_rooms.py"), "--check"]
    status = subprocess.run(check, timeout=60, check=False).returncode
    assert status == 0, "run `python docs/draw_rooms.py`"


def test_the_catalogue_s_page_and_pictures_are_current() -> None:
    """A picture whose law changed is stale: cart, pole and force no longer do what it shows."""
    check = [sys.executable, str(ROOT / "docs" / "draw_signatures.py"), "--check"]
    done = subprocess.run(check, timeout=120, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"run `python docs/draw_signatures.py`: {done.stdout}"
    pictures = {path.stem for path in (ROOT / "docs" / "images" / "effects").glob("*.png")}
    assert pictures == set(BY_NAME)


def test_the_verbs_are_listed() -> None:
    table = section((ROOT / "docs" / "command_line.md").read_text(encoding="utf-8"), VERBS)
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) == set(MODULES)


def test_the_glossary_is_in_alphabetical_order() -> None:
    glossary = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    terms = re.findall(r"^\| \*\*(.+?)\*\* \|", glossary, re.MULTILINE)
    assert terms
    assert terms == sorted(terms, key=str.casefold)


def test_a_part_of_a_recording_is_that_part(tmp_path: Path) -> None:
    whole = read_bag(made_bag(tmp_path / "whole", made(INTECO, seconds=6.0)))
    script = [
        sys.executable,
        ROOT / "docs" / "cut_recording.py",
        tmp_path / "whole",
        tmp_path / "part",
        "2",
        "5",
    ]
    subprocess.run([str(part) for part in script], check=True, timeout=60)
    part = read_bag(tmp_path / "part")
    np.testing.assert_allclose(part.state_stamp_s, np.arange(300) * 0.01, atol=1e-9)
    for name in ("cart", "pole", "command"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[200:500])


def test_commands_on_real_rigs_run(tmp_path: Path) -> None:
    if "RIGS" not in os.environ:
        pytest.skip(
            "takes minutes: set RIGS to the folder that holds the recordings of docs/real_rigs.md"
        )
    for name, place in (
        (".venv", sys.prefix),
        ("config", ROOT / "config"),
        ("docs", ROOT / "docs"),
    ):
        (tmp_path / name).symlink_to(place)
    (tmp_path / "out").mkdir()
    for command in shell_lines(REAL_RIGS):
        run(command, tmp_path)

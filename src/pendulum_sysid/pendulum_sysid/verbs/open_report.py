"""The verb `open`: show what a command wrote in the browser."""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

from pendulum_sysid.errors import FileError
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.suggest import add_hint

PAGES = ("report.html", "index.html", "proof.html")  # of a diagnosis, a fleet's site, a proof
BELOW = ("diagnosis",)  # folder of a demo in which its report lies


def run(arguments: argparse.Namespace) -> int:
    """Open the page in the browser and print its path; say where there is no browser."""
    page = find_page(arguments.folder).resolve()
    opened = open_browser(page)
    print_answer(arguments, lambda: {"page": str(page), "opened": opened}, page)
    if not opened:
        say(f"{page}: no browser opened here: open the file yourself", ANSWERED)
    return ANSWERED


def find_page(path: Path) -> Path:
    """Return the page that a path stands for; raise FileError where there is none."""
    if path.is_file() and path.suffix == ".html":
        return path
    for folder in (path, *(path / name for name in BELOW)):
        for name in PAGES:
            if (folder / name).is_file():
                return folder / name
    near = [p.name for p in path.absolute().parent.glob("*/")] if not path.exists() else []
    raise FileError(
        f"{path}: expected a folder with {', '.join(PAGES)}, found none: give the --out of "
        f"sysid diagnose, fleet page or prove{add_hint(path.name, near)}"
    )


def open_browser(page: Path) -> bool:
    """Show a file in the user's browser; return whether a browser took it."""
    try:
        return webbrowser.open(page.as_uri())
    except webbrowser.Error:
        return False

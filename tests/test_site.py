"""The site of `make docs`: it builds without a warning and loads nothing from elsewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from support.paths import ROOT

import pendulum_sysid


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_every_public_name_stands_on_the_page_of_the_api(site: Path) -> None:
    page = (site / "api.html").read_text()
    for name in pendulum_sysid.__all__:
        assert re.search(rf'id="pendulum_\w+(\.\w+)*\.{name}"', page), name


def test_the_pages_load_nothing_from_elsewhere(site: Path) -> None:
    for page in site.glob("*.html"):
        loaded = re.findall(
            r'<(?:script|img|link)[^>]*(?:src|href)="(https?://[^"]+)', page.read_text()
        )
        assert [url for url in loaded if "canonical" not in url] == [], page.name


def test_pages_stand_in_the_navigation_and_design_is_shown(site: Path) -> None:
    start = (site / "index.html").read_text()
    for page in ROOT.glob("docs/*.md"):
        assert f'href="{page.stem}.html"' in start or page.stem == "index", page.name
    assert "The kernel" in (site / "design.html").read_text()


def test_pictures_are_there(site: Path) -> None:
    for page in site.glob("*.html"):
        for picture in re.findall(r'<img[^>]* src="([^":]+)"', page.read_text()):
            assert (site / picture).is_file(), (page.name, picture)


def test_pages_link_to_pages_only(site: Path) -> None:
    for page in site.glob("*.html"):
        links = re.findall(r'href="([^"#:]+\.html)', page.read_text())
        assert all((site / link).exists() for link in links if not link.startswith("/")), page.name

"""Folders of this workspace, for tests in any folder."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src"
CONFIG = ROOT / "config"
SHARED_DATA = ROOT.parent / "shared" / "data"  # recordings of real rigs; absent on most machines

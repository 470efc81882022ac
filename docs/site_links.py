"""A hook of `make docs`: DESIGN.md as a page, and links out of docs/ as plain text."""

import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
SHOWN = {"design.md": "DESIGN.md"}  # page of the site -> file of the repository's root
LINK = r"(?<!!)\[([^\]]+)\]"


def on_page_markdown(markdown: str, page: Any = None, **_: object) -> str:
    """Return a page without links that leave the folder docs/."""
    shown = SHOWN.get(page.file.src_uri) if page is not None else None
    if shown is None:
        return re.sub(rf"{LINK}\(\.\./[^)]*\)", r"\1", markdown)
    text = (ROOT / shown).read_text(encoding="utf-8")
    text = re.sub(rf"{LINK}\((?!docs/|#|https?:)[^)]*\)", r"\1", text)
    return text.replace("](docs/", "](")

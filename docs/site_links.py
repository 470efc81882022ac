"""A hook of `make docs`: links from the pages to files of the repository become plain text."""

import re


def on_page_markdown(markdown: str, **_: object) -> str:
    """Return a page without links that leave the folder docs/."""
    return re.sub(r"(?<!!)\[([^\]]+)\]\(\.\./[^)]*\)", r"\1", markdown)

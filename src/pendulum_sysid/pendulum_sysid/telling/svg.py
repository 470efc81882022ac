"""The look of the report's pictures and their form: small inline SVG, always the same bytes."""

from __future__ import annotations

import io
import re
from html import escape
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pendulum_sysid.verdict.look import ACCENT, INK, PALE, SOFT
from pendulum_twin.arrays import Floats, Ints

POINTS = 160  # most points that a line is drawn with
VARIABLES = {INK: "ink", SOFT: "soft", PALE: "pale", ACCENT: "accent"}  # of the page's style sheet
MEASURED: dict[str, Any] = {"color": PALE, "linewidth": 4.0, "solid_capstyle": "round"}
BEFORE: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (3.5, 2.0))}
AFTER: dict[str, Any] = {"color": ACCENT, "linewidth": 1.4}
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "pendulum",
    "font.family": "DejaVu Sans",  # comes with matplotlib; the font of the page replaces it
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.titley": 1.02,  # a fixed height: matplotlib measures all labels otherwise
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "hatch.linewidth": 0.5,
}
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


def render_svg(figure: Figure, key: str, label: str) -> str:
    """Return a figure as an `svg` element that scales with the page.

    key: begins every id in the element; unique on the page.
    label: what the picture shows, for a screen reader.
    """
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata=NO_METADATA)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' (?:width|height)="[\d.]+pt"', "", text, count=2)
    text = re.sub(r' d="[^"]*"', _shorten_numbers, text)
    text = re.sub(r"\n\s*", "\n", _make_ids_unique(text, key))
    for colour, name in VARIABLES.items():  # so that pictures follow a dark page
        text = text.replace(colour, f"var(--{name}, {colour})")
    return text.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1)


def thin_out(samples: int, most: int = POINTS) -> Ints:
    """Return the indices of at most `most` samples, the first and the last among them."""
    return np.unique(np.round(np.linspace(0, samples - 1, min(samples, most))).astype(np.int64))


def find_largest(values: Floats) -> float:
    """Return the largest finite magnitude; 0 where no value is finite."""
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _shorten_numbers(path: re.Match[str]) -> str:
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0])


def _make_ids_unique(text: str, key: str) -> str:
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', text))
    prefix = re.sub(r"[^\w-]", "", key)
    text = re.sub(
        r' id="([^"]+)"', lambda m: f' id="{prefix}-{m[1]}"' if m[1] in used else "", text
    )
    return re.sub(r'(url\(|href=")#', rf"\1#{prefix}-", text)

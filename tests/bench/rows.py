"""The benchmarks' table."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """Hold a line of the table.

    what: the quantity.
    ours, theirs: figures with their unit.
    peer: whose the other figure is.
    ratio: how many times better ours is.
    """

    what: str
    ours: str
    peer: str
    theirs: str
    ratio: float


def format_table(rows: list[Row]) -> str:
    """Return rows as aligned text."""
    lines = [("", "this twin", "peer", "", "ratio")]
    lines += [
        (
            r.what,
            r.ours,
            r.peer,
            r.theirs,
            f"{r.ratio:,.1f}" if r.ratio >= 10 else f"{r.ratio:.2g}",
        )
        for r in rows
    ]
    widths = [max(len(line[k]) for line in lines) for k in range(5)]
    aligns = ("<", ">", "<", ">", ">")
    return "\n".join(
        "  ".join(
            f"{cell:{align}{width}}"
            for cell, align, width in zip(line, aligns, widths, strict=True)
        ).rstrip()
        for line in lines
    )

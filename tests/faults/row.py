"""A line of the table of faults, and the table."""

from dataclasses import dataclass

HEAD = ("fault", "PWM 0 after", "what is right, and was checked", "what was said")


@dataclass(frozen=True)
class Row:
    """Hold what came of a fault.

    zero_s: from the fault until the rig got PWM 0 for good, s; None where something else is right.
    right: what was checked.
    said: the sentence that a person gets.
    """

    fault: str
    zero_s: float | None
    right: str
    said: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        return (
            self.fault,
            "" if self.zero_s is None else f"{1e3 * self.zero_s:.1f} ms",
            self.right,
            self.said,
        )


def line(cells: tuple[str, ...]) -> str:
    """Return a line of a Markdown table."""
    return "| " + " | ".join(" ".join(cell.replace("|", "/").split()) for cell in cells) + " |"


def head() -> str:
    """Return the first two lines of the table."""
    return f"{line(HEAD)}\n|---|---:|---|---|"

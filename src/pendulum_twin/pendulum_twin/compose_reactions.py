"""Write the functions by which the cart acts back on a drive that has a mass of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pendulum_twin.compose import (
    LAG,
    LANE,
    PULL,
    REACTING,
    REACTION_ROWS,
    SLOPE,
    compile_text,
    list_arguments,
)


def compose_shares() -> Callable[..., Any]:
    """Return total(p, i, width): the share of lane i's moved mass that is the drive's own."""
    lines, laws = ["total = 0.0"], {}
    for e in REACTING:
        assert e.reaction is not None
        laws[e.name] = e.reaction.share
        lines.append(f"total += {e.name}({', '.join(list_arguments(e, LANE))})")
    return compile_text("total", "p, i, width", [*lines, "return total"], laws)


def compose_pulls() -> Callable[..., Any]:
    """Return total(first, p, i, width): what the drive's own mass takes of other forces, N.

    first: row of the first number that a reaction keeps; the others lie below it.
    """
    lines, laws = ["total = 0.0"], {}
    for n, e in enumerate(REACTING):
        assert e.reaction is not None
        laws[e.name] = e.reaction.share
        share = f"{e.name}({', '.join(list_arguments(e, LANE))})"
        lines.append(f"total += {share} * p[(first + {n * REACTION_ROWS + PULL}) * width + i]")
    return compile_text("total", "first, p, i, width", [*lines, "return total"], laws)


def compose_reactions() -> Callable[..., Any]:
    """Return react(first, push, h, p, i, width), which puts what a substep leaves into p.

    push: N, mean of the other forces on the cart over the substep of h s; first: see
    `compose_pulls`.
    """
    lines, laws = ["pass"], {}
    for n, e in enumerate(REACTING):
        assert e.reaction is not None
        laws[e.name] = e.reaction.law
        lag, slope, pull = (
            f"p[(first + {n * REACTION_ROWS + k}) * width + i]" for k in (LAG, SLOPE, PULL)
        )
        arguments = ", ".join(["push", lag, slope, "h", *list_arguments(e, LANE)])
        lines.append(f"{lag}, {slope}, {pull} = {e.name}({arguments})")
    return compile_text("react", "first, push, h, p, i, width", lines, laws)

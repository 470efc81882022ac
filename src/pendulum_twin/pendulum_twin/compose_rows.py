"""Write the functions that ask laws effect by effect, so that an effect that is off costs nothing.

A branch within the loop over lanes costs twice the time, or keeps the compiler from computing
lanes side by side. So each effect has a loop over the lanes of its own, behind a branch for the
whole block, and adds to rows of the block. Where a lane is computed by itself, the branch is the
lane's own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pendulum_twin.block import (
    EVEN,
    FORCE,
    FREED,
    LOAD,
    MIDDLE,
    MOVE,
    PATH,
    SWITCHES,
    TIME,
    X_BEFORE,
    H,
    V,
    X,
)
from pendulum_twin.compose import (
    ASKED,
    COSTLY_SUMS,
    LANE,
    SWITCHED,
    call_path_laws,
    compile_text,
    list_arguments,
    list_effects,
    write_held_calls,
)
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.equations import compile_apart
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values

EVERYWHERE = tuple(Place)


def _write_question(effects: list[int]) -> str:
    """Return the text that asks whether any of these effects is on in any lane of the block."""
    rows = (SWITCHES + SWITCHED.index(k) for k in effects)
    return " or ".join(f"p[{row} * width] > 0.0" for row in rows) or "False"


def _indent(head: str, lines: list[str]) -> list[str]:
    return [head, *(f"    {line}" for line in lines)]


def _loop_if_on(effect: int, lines: list[str]) -> list[str]:
    """Return a loop of these lines over the lanes, where the effect is on in any of them."""
    return _indent(f"if {_write_question([effect])}:", _indent("for i in range(width):", lines))


def _place(row: int) -> str:
    """Return the text of lane i's place in a row."""
    return LANE.format(word=row)


def _call(effect: Effect, where: list[str]) -> str:
    return f"{effect.name}({', '.join([*where, *list_arguments(effect, LANE)])})"


def _collect_laws(effects: list[tuple[int, Effect]]) -> dict[str, Callable[..., Any]]:
    return {e.name: e.law for _, e in effects}


def compose_question(effects: list[int]) -> Callable[..., Any]:
    """Return are_on(p, width): whether any of these effects is on in any lane of the block.

    effects: their indices in the catalogue.
    """
    return compile_text("are_on", "p, width", [f"return {_write_question(effects)}"], {})


def _list_costly() -> list[tuple[int, Effect]]:
    return [(k, CATALOGUE[k]) for k in ASKED]


def _call_costly(effect: Effect, speeds: tuple[str, str]) -> str:
    """Return the text of a costly law's call; speeds: text of those of cart and pole."""
    of_pole = effect.place is Place.POLE
    of_joint = [speeds[of_pole], "th" if of_pole else "x"]
    return _call(effect, of_joint if effect.form is Form.DRY else ["x", "v", "th", "w"])


def compose_costly_sums() -> Callable[..., Any]:
    """Return add(x, th, v, w, p, i, width): what costly laws add at a state of lane i.

    The four numbers are those of `compose.COSTLY_SUMS`.
    """
    names = [f"sum_{n}" for n in range(len(COSTLY_SUMS))]
    lines = [f"{name} = 0.0" for name in names]
    for _, e in _list_costly():
        slot, name = SLOTS[e.name], names[COSTLY_SUMS.index((e.form, e.place))]
        values = zip(range(slot.start, slot.stop), get_neutral_values(e), strict=True)
        differs = " or ".join(f"{_place(word)} != {neutral!r}" for word, neutral in values)
        lines += _indent(f"if {differs}:", [f"{name} += {_call_costly(e, ('abs(v)', 'abs(w)'))}"])
    lines.append(f"return {', '.join(names)}")
    laws = _collect_laws(_list_costly())
    return compile_text("add", "x, th, v, w, p, i, width", lines, laws, compile_apart)


def compose_costly_rows() -> Callable[..., Any]:
    """Return ask(state, sums, moves, p, width): what costly laws add at a state of every lane.

    state: first row of the states; sums: first row of the four numbers of `compose.COSTLY_SUMS`.
    moves: 0 for the dry friction of joints that stand there, without forces; else 1.
    """
    lines = _indent("for i in range(width):", ["for k in range(4):"])
    lines.append("        p[(sums + k) * width + i] = 0.0")
    names = enumerate(("x", "th", "v", "w"))
    take = [f"{name} = p[(state + {k}) * width + i]" for k, name in names]
    for k, e in _list_costly():
        total = f"p[(sums + {COSTLY_SUMS.index((e.form, e.place))}) * width + i]"
        call = _call_costly(e, ("moves * abs(v)", "moves * abs(w)"))
        loop = _loop_if_on(k, [*take, f"{total} += {call}"])
        lines += loop if e.form is Form.DRY else _indent("if moves > 0.0:", loop)
    lines = _indent(f"if {_write_question(ASKED)}:", lines)
    laws = _collect_laws(_list_costly())
    return compile_text("ask", "state, sums, moves, p, width", lines, laws)


def compose_load_rows() -> Callable[..., Any]:
    """Return add(p, width), which adds to row LOAD what effects add to every lane's mass."""
    effects = list_effects(Form.TIMED_MASS, EVERYWHERE)
    lines = ["pass"]
    for k, e in effects:
        lines += _loop_if_on(k, [f"{_place(LOAD)} += {_call(e, [_place(TIME), _place(H)])}"])
    return compile_text("add", "p, width", lines, _collect_laws(effects))


def compose_held_rows() -> Callable[..., Any]:
    """Return add(p, width), which adds to rows EVEN what `compose.compose_held` returns."""
    calls, lines = write_held_calls(), ["pass"]
    names = [
        *(("x", MIDDLE), ("th", MIDDLE + 1), ("w", MIDDLE + 3), ("t", TIME)),
        *((name, EVEN + n) for n, name in enumerate(("gain", "force", "dry", "viscous"))),
    ]
    for k, _, line in calls:
        take = [f"{name} = {_place(row)}" for name, row in names]
        put = [f"{_place(row)} = {name}" for name, row in names if row >= EVEN]
        lines += _loop_if_on(k, [*take, line, *put])
    return compile_text("add", "p, width", lines, _collect_laws([(k, e) for k, e, _ in calls]))


def compose_path_rows() -> Callable[..., Any]:
    """Return add(p, width), which adds the forces in the middle of a step to rows EVEN."""
    move = f"0.5 * {_place(H)} * {_place(V)}"
    return _compose_path_laws("add", move, f"{_place(EVEN + 1)} += {{call}}")


def compose_path_following() -> Callable[..., Any]:
    """Return follow(p, width), which keeps the forces behind a step of every lane."""
    move = f"{_place(X)} - {_place(X_BEFORE)}"
    return _compose_path_laws("follow", move, "p[(first + {n}) * width + i] = {call}")


def _compose_path_laws(name: str, move: str, use: str) -> Callable[..., Any]:
    """Return the function of this name that asks the laws of path forces.

    move: text of the move, which row MOVE keeps: a loop that does less is unrolled before the
        compiler can compute lanes side by side.
    use: text of what becomes of a law's call; {call} is the call, {n} the number of the law among
        the path forces.
    """
    effects = list_effects(Form.PATH_FORCE, EVERYWHERE)
    text = [f"first = {PATH}"]
    for n, ((k, _), call) in enumerate(zip(effects, call_path_laws(effects), strict=True)):
        lines = [f"move = {move}", f"{_place(MOVE)} = move", use.format(n=n, call=call)]
        text += _loop_if_on(k, lines)
    return compile_text(name, "p, width", text, _collect_laws(effects))


def compose_drive_rows() -> Callable[..., Any]:
    """Return bend(p, width): what the drive does to every lane, from its force in row FORCE.

    It changes this force, and adds to row FREED what it adds to the viscous friction.
    """
    effects = list_effects(Form.DRIVE, EVERYWHERE)
    lines = ["pass"]
    for k, e in effects:
        call = _call(e, [_place(FORCE), _place(V)])
        put = [f"{_place(FORCE)} = force", f"{_place(FREED)} += more"]
        lines += _loop_if_on(k, [f"force, more = {call}", *put])
    return compile_text("bend", "p, width", lines, _collect_laws(effects))

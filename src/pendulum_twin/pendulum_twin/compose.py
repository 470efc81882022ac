"""Write the functions that the kernel calls from the catalogue's laws.

Numba cannot loop over a list of different functions, so the source text of each function has a
call per effect. The laws of cart and pole are called whether their effects are on or not: at
neutral values they add exactly nothing, and code without branches is computed for many lanes at
once.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.equations import compile_inner, exp, sin_cos, sin_cos_of_array
from pendulum_twin.parameter_vector import BASE, SLOTS

# Where the text finds number {word} of theta: of lane i in a block of lanes, or of a lane alone.
LANE = "p[{word} * width + i]"
ALONE = "p[{word}]"
# Forms of what acts evenly over a step.
HELD_FORMS = (
    Form.GAIN,
    Form.DRIVE,
    Form.TIMED_FORCE,
    Form.TIMED_FRICTION,
    Form.TIMED_MASS,
    Form.STATE_FRICTION,
    Form.PATH_FORCE,
)
PATHS = sum(effect.form is Form.PATH_FORCE for effect in CATALOGUE)
# Effects with a reaction, and the rows of p that each keeps: lag (N), slope (N/s) and pull (N).
REACTING = [effect for effect in CATALOGUE if effect.reaction is not None]
LAG, SLOPE, PULL, REACTION_ROWS = range(4)
KEPT = PATHS + REACTION_ROWS * len(REACTING)
TRANSCENDENTAL = {"exp", "sin", "cos", "sin_cos", "tanh"}


def _list_arguments(effect: Effect, where: str) -> list[str]:
    """Return the text of a law's constants and parameters; where: LANE or ALONE."""
    slot = SLOTS[effect.name]
    words = [BASE.index(name) for name in effect.constants] + list(range(slot.start, slot.stop))
    return [where.format(word=word) for word in words]


def is_costly(effect: Effect) -> bool:
    """Return whether only kernels with all laws hold the law.

    Others are of plain arithmetic, or act evenly over a step and so are taken once a step.
    """
    costs = not TRANSCENDENTAL.isdisjoint(effect.law.__code__.co_names)
    return costs and effect.form not in HELD_FORMS


def _list_effects(form: Form, places: tuple[Place, ...]) -> list[tuple[int, Effect]]:
    """Return the effects of a form at these places, each with its index in the catalogue."""
    return [(k, e) for k, e in enumerate(CATALOGUE) if e.form is form and e.place in places]


def _compile(
    name: str, signature: str, lines: list[str], effects: list[tuple[int, Effect]]
) -> Callable[..., Any]:
    """Return the function of this name, signature and lines, which calls the laws of effects."""
    return _compile_text(name, signature, lines, {e.name: e.law for _, e in effects})


def _compile_text(
    name: str, signature: str, lines: list[str], laws: dict[str, Callable[..., Any]]
) -> Callable[..., Any]:
    """Return the function of this name, signature and lines, which calls the laws by name."""
    scope: dict[str, Any] = {key: _compile_law(law) for key, law in laws.items()}
    source = f"def {name}({signature}):\n" + "\n".join(f"    {line}" for line in lines)
    exec(compile(source, f"<{name} of the catalogue>", "exec"), scope)
    return compile_inner(scope[name])


def _compile_law(law: Callable[..., Any]) -> Callable[..., Any]:
    """Return the compiled law; it calls compiled functions in place of the plain ones.

    So do functions of its own file that the law calls.
    """
    called = {key: law.__globals__.get(key) for key in law.__code__.co_names}
    own = {
        key: _compile_law(value)
        for key, value in called.items()
        if isinstance(value, FunctionType) and value.__module__ == law.__module__
    }
    compiled = {"exp": exp, "sin_cos": sin_cos, "sin_cos_of_array": sin_cos_of_array}
    names = {**law.__globals__, **own, **compiled}
    return compile_inner(FunctionType(law.__code__, names, law.__name__))


def compose_filters(of_command: bool) -> Callable[..., Any]:
    """Return apply(out, memory, offsets, h, first_step, p, active), which filters out in place.

    of_command: True for the filters of the command, False for those behind it.

    Nothing feeds back, so each filter runs over all substeps before the next filter begins.
    """
    filters = _list_effects(Form.FILTER, tuple(Place))
    effects = [pair for pair in filters if (pair[1].place is Place.COMMAND) == of_command]
    lines = ["pass"]
    for k, e in effects:
        n = filters.index((k, e))
        arguments = ", ".join(
            ["out[at]", "kept", "h", "(first_step + at) * h", *_list_arguments(e, ALONE)]
        )
        lines += [
            f"if active[{k}]:",
            f"    kept = memory[offsets[{n}] : offsets[{n + 1}]]",
            "    for at in range(len(out)):",
            f"        out[at] = {e.name}({arguments})",
        ]
    return _compile("apply", "out, memory, offsets, h, first_step, p, active", lines, effects)


def compute_memory_sizes(h: float) -> list[int]:
    """Return how many numbers each filter keeps for substeps of h s, in chain order."""
    sizes = []
    for _, effect in _list_effects(Form.FILTER, tuple(Place)):
        assert effect.memory is not None
        sizes.append(effect.memory(h))
    return sizes


def compose_sensors(undo: bool = False) -> Callable[..., Any]:
    """Return measure(x, v, th, w, t, p, active): true to measured state, x, v, th, w again.

    An angle that is read late, or followed, is where the pole's rate says that it was.

    undo: whether measured states become true states instead.
    """
    laws: dict[str, Callable[..., Any]] = {}
    effects, late = _list_effects(Form.MEASURE, tuple(Place)), []
    lines: list[str] = []
    behind = [_list_effects(form, tuple(Place)) for form in (Form.LATE, Form.LAGGING)]
    for k, e in (*behind[0], *behind[1]):
        laws[e.name] = e.law
        way = f"{'+' if undo else '-'}= {e.name}({', '.join(_list_arguments(e, ALONE))}) * w"
        late += [f"if active[{k}]:", f"    th {way}"]
    for k, e in reversed(effects) if undo else effects:
        law = e.inverse if undo else e.law
        if law is not None:
            laws[e.name] = law
            arguments = ", ".join(["x, v, th, w, t", *_list_arguments(e, ALONE)])
            lines += [f"if active[{k}]:", f"    x, v, th, w = {e.name}({arguments})"]
    lines = [*lines, *late] if undo else [*late, *lines]
    signature = "x, v, th, w, t, p, active"
    return _compile_text("measure", signature, [*lines, "return x, v, th, w"], laws)


def compose_reports() -> Callable[..., Any]:
    """Return report(rate, before, period_s, p, active): a velocity as it is reported."""
    effects = _list_effects(Form.REPORT, tuple(Place))
    lines = []
    for k, e in effects:
        arguments = ", ".join(["rate, before, period_s", *_list_arguments(e, ALONE)])
        lines += [f"if active[{k}]:", f"    rate = {e.name}({arguments})"]
    return _compile(
        "report", "rate, before, period_s, p, active", [*lines, "return rate"], effects
    )


def compose_pace() -> Callable[..., Any]:
    """Return pace(p, i, width): time, s, that passes on lane i per second of its stamps."""
    effects = _list_effects(Form.CLOCK, (Place.CLOCK,))
    lines = ["pace = 1.0"] + [
        f"pace *= {e.name}({', '.join(_list_arguments(e, LANE))})" for _, e in effects
    ]
    return _compile("pace", "p, i, width", [*lines, "return pace"], effects)


def compose_forces(place: Place) -> Callable[..., Any]:
    """Return total(x, v, th, w, p, i, width, laws): all forces of a place on lane i, N or N m."""
    effects = _list_effects(Form.FORCE, (place,))
    lines = ["total = 0.0"]
    for _, e in effects:
        lines += _guard_costly(
            e, f"total += {e.name}({', '.join(['x', 'v', 'th', 'w', *_list_arguments(e, LANE)])})"
        )
    return _compile("total", "x, v, th, w, p, i, width, laws", [*lines, "return total"], effects)


def compose_held() -> Callable[..., Any]:
    """Return hold(x, th, w, t, p, i, width): what acts evenly over a step of lane i.

    Gain on the drive's force; force on the cart, N; what is added to the cart's dry friction, N,
    and to its viscous friction, N s/m.
    """
    added = {
        Form.GAIN: "gain *= {}(x, {})",
        Form.TIMED_FORCE: "force += {}(t, {})",
        Form.TIMED_FRICTION: "level, drag = {}(t, {}); dry += level; viscous += drag",
        Form.STATE_FRICTION: "dry += {}(th, w, {})",
    }
    lines, effects = ["gain, force, dry, viscous = 1.0, 0.0, 0.0, 0.0"], []
    for form, line in added.items():
        for pair in _list_effects(form, tuple(Place)):
            lines.append(line.format(pair[1].name, ", ".join(_list_arguments(pair[1], LANE))))
            effects.append(pair)
    lines.append("return gain, force, dry, viscous")
    return _compile("hold", "x, th, w, t, p, i, width", lines, effects)


def compose_drive_laws() -> Callable[..., Any]:
    """Return bend(force, v, p, i, width): what the drive does to lane i over a step.

    Its force, N; what is added to the viscous friction of the cart, N s/m.
    """
    effects = _list_effects(Form.DRIVE, tuple(Place))
    lines = ["viscous = 0.0"]
    for _, e in effects:
        arguments = ", ".join(["force", "v", *_list_arguments(e, LANE)])
        lines += [f"force, more = {e.name}({arguments})", "viscous += more"]
    return _compile("bend", "force, v, p, i, width", [*lines, "return force, viscous"], effects)


def compose_loads() -> Callable[..., Any]:
    """Return total(t, h, p, i, width): mass added to all that lane i moves over a step, kg."""
    effects = _list_effects(Form.TIMED_MASS, tuple(Place))
    lines = ["total = 0.0"] + [
        f"total += {e.name}({', '.join(['t', 'h', *_list_arguments(e, LANE)])})"
        for _, e in effects
    ]
    return _compile("total", "t, h, p, i, width", [*lines, "return total"], effects)


def compose_path_forces() -> Callable[..., Any]:
    """Return total(first, move, p, i, width): forces on the cart after a move, m, of lane i, N.

    first: row of the first force that follows the path; the others lie below it.
    """
    effects = _list_effects(Form.PATH_FORCE, tuple(Place))
    lines = ["total = 0.0", *(f"total += {call}" for call in _call_path_laws(effects))]
    return _compile("total", "first, move, p, i, width", [*lines, "return total"], effects)


def compose_path_following() -> Callable[..., Any]:
    """Return follow(first, move, p, i, width), which puts the forces after a move into p."""
    effects = _list_effects(Form.PATH_FORCE, tuple(Place))
    lines = [
        f"p[(first + {k}) * width + i] = {call}" for k, call in enumerate(_call_path_laws(effects))
    ]
    return _compile("follow", "first, move, p, i, width", ["pass", *lines], effects)


def _call_path_laws(effects: list[tuple[int, Effect]]) -> list[str]:
    """Return the text of a call of each law, from the force that its row of p holds."""
    calls = []
    for k, (_, effect) in enumerate(effects):
        kept = f"p[(first + {k}) * width + i]"
        arguments = ", ".join([kept, "move", *_list_arguments(effect, LANE)])
        calls.append(f"{effect.name}({arguments})")
    return calls


def compose_shares() -> Callable[..., Any]:
    """Return total(p, i, width): the share of lane i's moved mass that is the drive's own."""
    lines, laws = ["total = 0.0"], {}
    for e in REACTING:
        assert e.reaction is not None
        laws[e.name] = e.reaction.share
        lines.append(f"total += {e.name}({', '.join(_list_arguments(e, LANE))})")
    return _compile_text("total", "p, i, width", [*lines, "return total"], laws)


def compose_pulls() -> Callable[..., Any]:
    """Return total(first, p, i, width): what the drive's own mass takes of other forces, N.

    first: row of the first number that a reaction keeps; the others lie below it.
    """
    lines, laws = ["total = 0.0"], {}
    for n, e in enumerate(REACTING):
        assert e.reaction is not None
        laws[e.name] = e.reaction.share
        share = f"{e.name}({', '.join(_list_arguments(e, LANE))})"
        lines.append(f"total += {share} * p[(first + {n * REACTION_ROWS + PULL}) * width + i]")
    return _compile_text("total", "first, p, i, width", [*lines, "return total"], laws)


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
        arguments = ", ".join(["push", lag, slope, "h", *_list_arguments(e, LANE)])
        lines.append(f"{lag}, {slope}, {pull} = {e.name}({arguments})")
    return _compile_text("react", "first, push, h, p, i, width", lines, laws)


def compose_dry_level(place: Place) -> Callable[..., Any]:
    """Return level(speed, position, way, p, i, width, laws): dry friction of a joint, N or N m.

    way: 1 or -1, the direction in which the joint slips or is pushed.
    """
    dry, ratios = _list_effects(Form.DRY, (place,)), _list_effects(Form.DRY_RATIO, (place,))
    lines = ["level = 0.0"]
    for _, e in dry:
        lines += _guard_costly(
            e, f"level += {e.name}({', '.join(['speed', 'position', *_list_arguments(e, LANE)])})"
        )
    for _, e in ratios:
        lines += _guard_costly(
            e, f"level *= {e.name}({', '.join(['way', *_list_arguments(e, LANE)])})"
        )
    return _compile(
        "level", "speed, position, way, p, i, width, laws", [*lines, "return level"], dry + ratios
    )


def _guard_costly(effect: Effect, line: str) -> list[str]:
    """Return a line that calls a law, under the condition that costly laws are compiled in."""
    return ["if len(laws) > 2:", f"    {line}"] if is_costly(effect) else [line]


def compose_holds() -> Callable[..., Any]:
    """Return frozen(force, v, w, p, i, width): whether the whole state of lane i stands still."""
    effects = _list_effects(Form.HOLD, (Place.CART,))
    calls = [
        f"{e.name}({', '.join(['force', 'v', 'w', *_list_arguments(e, LANE)])})"
        for _, e in effects
    ]
    return _compile(
        "frozen", "force, v, w, p, i, width", [f"return {' | '.join(calls) or 'False'}"], effects
    )

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
# What costly laws add at a state: force on the cart, torque on the pole, dry friction of both.
COSTLY_SUMS = [
    (form, place) for form in (Form.FORCE, Form.DRY) for place in (Place.CART, Place.POLE)
]
TRANSCENDENTAL = {"exp", "sin", "cos", "sin_cos", "tanh"}


def list_arguments(effect: Effect, where: str) -> list[str]:
    """Return the text of a law's constants and parameters; where: LANE or ALONE."""
    slot = SLOTS[effect.name]
    words = [BASE.index(name) for name in effect.constants] + list(range(slot.start, slot.stop))
    return [where.format(word=word) for word in words]


def is_costly(effect: Effect) -> bool:
    """Return whether each stage of a step asks the law, which is not of plain arithmetic."""
    costs = not TRANSCENDENTAL.isdisjoint(effect.law.__code__.co_names)
    return costs and (effect.form, effect.place) in COSTLY_SUMS


# Effects, by their indices, that a block of lanes asks only where they are on in any lane: costly
# laws, and what acts evenly over a step or back on the drive.
ASKED = [k for k, effect in enumerate(CATALOGUE) if is_costly(effect)]
REACTING_AT = [k for k, effect in enumerate(CATALOGUE) if effect.reaction is not None]
HELD = [k for k, e in enumerate(CATALOGUE) if e.form in HELD_FORMS or k in REACTING_AT]
SWITCHED = [*ASKED, *HELD]


def list_effects(form: Form, places: tuple[Place, ...]) -> list[tuple[int, Effect]]:
    """Return the effects of a form at these places, each with its index in the catalogue."""
    return [(k, e) for k, e in enumerate(CATALOGUE) if e.form is form and e.place in places]


def _compile(
    name: str, signature: str, lines: list[str], effects: list[tuple[int, Effect]]
) -> Callable[..., Any]:
    """Return the function of this name, signature and lines, which calls the laws of effects."""
    return compile_text(name, signature, lines, {e.name: e.law for _, e in effects})


def compile_text(
    name: str,
    signature: str,
    lines: list[str],
    laws: dict[str, Callable[..., Any]],
    compiler: Callable[..., Any] = compile_inner,
) -> Callable[..., Any]:
    """Return the function of this name, signature and lines, which calls the laws by name."""
    scope: dict[str, Any] = {key: _compile_law(law) for key, law in laws.items()}
    source = f"def {name}({signature}):\n" + "\n".join(f"    {line}" for line in lines)
    exec(compile(source, f"<{name} of the catalogue>", "exec"), scope)
    return compiler(scope[name])


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
    filters = list_effects(Form.FILTER, tuple(Place))
    effects = [pair for pair in filters if (pair[1].place is Place.COMMAND) == of_command]
    lines = ["pass"]
    for k, e in effects:
        n = filters.index((k, e))
        arguments = ", ".join(
            ["out[at]", "kept", "h", "(first_step + at) * h", *list_arguments(e, ALONE)]
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
    for _, effect in list_effects(Form.FILTER, tuple(Place)):
        assert effect.memory is not None
        sizes.append(effect.memory(h))
    return sizes


def compose_sensors(undo: bool = False) -> Callable[..., Any]:
    """Return measure(x, v, th, w, t, p, active): true to measured state, x, v, th, w again.

    An angle that is read late, or followed, is where the pole's rate says that it was. How late
    counts by the stamps, and the rate is of true time.

    undo: whether measured states become true states instead.
    """
    laws: dict[str, Callable[..., Any]] = {}
    effects, late = list_effects(Form.MEASURE, tuple(Place)), ["pace = 1.0"]
    lines: list[str] = []
    for _, e in list_effects(Form.CLOCK, (Place.CLOCK,)):
        laws[e.name] = e.law
        late += [f"pace *= {e.name}({', '.join(list_arguments(e, ALONE))})"]
    behind = [list_effects(form, tuple(Place)) for form in (Form.LATE, Form.LAGGING)]
    for k, e in (*behind[0], *behind[1]):
        laws[e.name] = e.law
        way = f"{'+' if undo else '-'}= {e.name}({', '.join(list_arguments(e, ALONE))}) * pace * w"
        late += [f"if active[{k}]:", f"    th {way}"]
    for k, e in reversed(effects) if undo else effects:
        law = e.inverse if undo else e.law
        if law is not None:
            laws[e.name] = law
            arguments = ", ".join(["x, v, th, w, t", *list_arguments(e, ALONE)])
            lines += [f"if active[{k}]:", f"    x, v, th, w = {e.name}({arguments})"]
    lines = [*lines, *late] if undo else [*late, *lines]
    signature = "x, v, th, w, t, p, active"
    return compile_text("measure", signature, [*lines, "return x, v, th, w"], laws)


def compose_reports() -> Callable[..., Any]:
    """Return report(rate, before, period_s, p, active): a velocity as it is reported."""
    effects = list_effects(Form.REPORT, tuple(Place))
    lines = []
    for k, e in effects:
        arguments = ", ".join(["rate, before, period_s", *list_arguments(e, ALONE)])
        lines += [f"if active[{k}]:", f"    rate = {e.name}({arguments})"]
    return _compile(
        "report", "rate, before, period_s, p, active", [*lines, "return rate"], effects
    )


def compose_pace() -> Callable[..., Any]:
    """Return pace(p, i, width): time, s, that passes on lane i per second of its stamps."""
    effects = list_effects(Form.CLOCK, (Place.CLOCK,))
    lines = ["pace = 1.0"] + [
        f"pace *= {e.name}({', '.join(list_arguments(e, LANE))})" for _, e in effects
    ]
    return _compile("pace", "p, i, width", [*lines, "return pace"], effects)


def compose_forces(place: Place) -> Callable[..., Any]:
    """Return total(x, v, th, w, applied, p, i, width): all forces of a place on lane i, N or N m.

    applied: see `motion`; costly laws are asked before.
    """
    effects = [(k, e) for k, e in list_effects(Form.FORCE, (place,)) if not is_costly(e)]
    lines = ["total = 0.0"] + [
        f"total += {e.name}({', '.join(['x', 'v', 'th', 'w', *list_arguments(e, LANE)])})"
        for _, e in effects
    ]
    lines += _add_costly("total", Form.FORCE, place)
    signature = "x, v, th, w, applied, p, i, width"
    return _compile("total", signature, [*lines, "return total"], effects)


def write_held_calls() -> list[tuple[int, Effect, str]]:
    """Return, for each law that acts evenly over a step, a line that adds it to what acts."""
    added = {
        Form.GAIN: "gain *= {}(x, {})",
        Form.TIMED_FORCE: "force += {}(t, {})",
        Form.TIMED_FRICTION: "level, drag = {}(t, {}); dry += level; viscous += drag",
        Form.STATE_FRICTION: "dry += {}(th, w, {})",
    }
    return [
        (k, e, line.format(e.name, ", ".join(list_arguments(e, LANE))))
        for form, line in added.items()
        for k, e in list_effects(form, tuple(Place))
    ]


def compose_held() -> Callable[..., Any]:
    """Return hold(x, th, w, t, p, i, width): what acts evenly over a step of lane i.

    Gain on the drive's force; force on the cart, N; what is added to the cart's dry friction, N,
    and to its viscous friction, N s/m.
    """
    lines, effects = ["gain, force, dry, viscous = 1.0, 0.0, 0.0, 0.0"], []
    for k, e, line in write_held_calls():
        lines.append(line)
        effects.append((k, e))
    lines.append("return gain, force, dry, viscous")
    return _compile("hold", "x, th, w, t, p, i, width", lines, effects)


def compose_drive_laws() -> Callable[..., Any]:
    """Return bend(force, v, p, i, width): what the drive does to lane i over a step.

    Its force, N; what is added to the viscous friction of the cart, N s/m.
    """
    effects = list_effects(Form.DRIVE, tuple(Place))
    lines = ["viscous = 0.0"]
    for _, e in effects:
        arguments = ", ".join(["force", "v", *list_arguments(e, LANE)])
        lines += [f"force, more = {e.name}({arguments})", "viscous += more"]
    return _compile("bend", "force, v, p, i, width", [*lines, "return force, viscous"], effects)


def compose_loads() -> Callable[..., Any]:
    """Return total(t, h, p, i, width): mass added to all that lane i moves over a step, kg."""
    effects = list_effects(Form.TIMED_MASS, tuple(Place))
    lines = ["total = 0.0"] + [
        f"total += {e.name}({', '.join(['t', 'h', *list_arguments(e, LANE)])})" for _, e in effects
    ]
    return _compile("total", "t, h, p, i, width", [*lines, "return total"], effects)


def compose_path_forces() -> Callable[..., Any]:
    """Return total(first, move, p, i, width): forces on the cart after a move, m, of lane i, N.

    first: row of the first force that follows the path; the others lie below it.
    """
    effects = list_effects(Form.PATH_FORCE, tuple(Place))
    lines = ["total = 0.0", *(f"total += {call}" for call in call_path_laws(effects))]
    return _compile("total", "first, move, p, i, width", [*lines, "return total"], effects)


def compose_path_following() -> Callable[..., Any]:
    """Return follow(first, move, p, i, width), which puts the forces after a move into p."""
    effects = list_effects(Form.PATH_FORCE, tuple(Place))
    lines = [
        f"p[(first + {k}) * width + i] = {call}" for k, call in enumerate(call_path_laws(effects))
    ]
    return _compile("follow", "first, move, p, i, width", ["pass", *lines], effects)


def call_path_laws(effects: list[tuple[int, Effect]]) -> list[str]:
    """Return the text of a call of each law, from the force that its row of p holds."""
    calls = []
    for k, (_, effect) in enumerate(effects):
        kept = f"p[(first + {k}) * width + i]"
        arguments = ", ".join([kept, "move", *list_arguments(effect, LANE)])
        calls.append(f"{effect.name}({arguments})")
    return calls


def compose_dry_level(place: Place) -> Callable[..., Any]:
    """Return level(speed, position, way, applied, p, i, width): dry friction, N or N m.

    way: 1 or -1, the direction in which the joint slips or is pushed.
    applied: see `motion`; costly laws are asked before.
    """
    dry = [(k, e) for k, e in list_effects(Form.DRY, (place,)) if not is_costly(e)]
    ratios = list_effects(Form.DRY_RATIO, (place,))
    lines = ["level = 0.0"] + [
        f"level += {e.name}({', '.join(['speed', 'position', *list_arguments(e, LANE)])})"
        for _, e in dry
    ]
    lines += _add_costly("level", Form.DRY, place) + [
        f"level *= {e.name}({', '.join(['way', *list_arguments(e, LANE)])})" for _, e in ratios
    ]
    signature = "speed, position, way, applied, p, i, width"
    return _compile("level", signature, [*lines, "return level"], dry + ratios)


def _add_costly(total: str, form: Form, place: Place) -> list[str]:
    """Return lines that add what costly laws add, where they are compiled in."""
    number = 4 + COSTLY_SUMS.index((form, place))
    return ["if len(applied) > 4:", f"    {total} += applied[{number}]"]


def compose_holds() -> Callable[..., Any]:
    """Return frozen(force, v, w, p, i, width): whether the whole state of lane i stands still."""
    effects = list_effects(Form.HOLD, (Place.CART,))
    calls = [
        f"{e.name}({', '.join(['force', 'v', 'w', *list_arguments(e, LANE)])})" for _, e in effects
    ]
    return _compile(
        "frozen", "force, v, w, p, i, width", [f"return {' | '.join(calls) or 'False'}"], effects
    )

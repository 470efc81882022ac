"""Write a measured law with a formula as an effect: a Python file for the user's own folder."""

from __future__ import annotations

import re

from pendulum_sysid.errors import WrongUse
from pendulum_sysid.verdict.record import MeasuredLaw
from pendulum_twin.laws import BY_NAME
from pendulum_twin.laws.kind import LawKind, Role, Variable

# Of each shape; `at` is the variable, the parameters' names are those of `measuring.shapes`.
EXPRESSIONS: dict[str, str] = {
    "constant": "offset",
    "line": "slope * at",
    "square": "factor * at * at",
    "signed square": "factor * at * abs(at)",
    "cube": "factor * at * at * at",
    "line and cube": "slope * at + factor * at * at * at",
    "size": "factor * abs(at)",
    "exponential": "factor * exp(-(at - x0) / length)",
    "bump": "factor * exp(-((at - centre) / width) * ((at - centre) / width))",
    "step": "before + (behind - before) / (1.0 + exp(-(at - place) / width))",
    "bend": "before * min(at - place, 0.0) + behind * max(at - place, 0.0)",
    "saturation": "factor * (1.0 - 2.0 / (exp(2.0 * at / width) + 1.0))",
    "wave": "sine * sin_cos(6.283185307179586 * at / period)[0] "
    "+ cosine * sin_cos(6.283185307179586 * at / period)[1]",
    "exponential and wave": "factor * exp(-(at - x0) / length) "
    "+ sine * sin_cos(6.283185307179586 * at / period)[0] "
    "+ cosine * sin_cos(6.283185307179586 * at / period)[1]",
}
# Roles that keep the offset of their formula. Where a constant of the rig is the same (a gain, a
# drag, a command), the offset is 0 and the constant follows.
KEEPS_OFFSET = (Role.FORCE, Role.TORQUE, Role.CART_DRY, Role.POLE_DRY)
TURN = re.compile(r"wave of a turn(?:, (\d) times)?")
SIZES = ("offset", "slope", "factor", "before", "behind", "sine", "cosine")
NOT_ZERO = ("length", "width", "period")  # the law divides by them

TEMPLATE = '''"""{title}

Learned from a recording: {sentence}
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import exp, sin_cos  # noqa: F401


def law({arguments}, {names}):
    """Return {returns}."""
    at = {variable}
    value = {expression}
    return {result}

{inverse}
EFFECT = Effect(
    name="{name}",
    place=Place.{place},
    form=Form.{form},
    law=law,
{more}    parameters=(
{parameters}    ),
    sentence="{words}",
    source="measured: {formula}",
)
'''
INVERSE = '''
def inverse(u, t, {names}):
    """Return the command that gives u, by repeated substitution."""
    given = u
    for _ in range(30):
        given = given + 0.7 * (u - law(given, (), 0.0, t, {names}))
    return given

'''


def write_effect(law: MeasuredLaw, name: str) -> str:
    """Return the source of an effect file; raise WrongUse for a law that no effect can hold."""
    kind = BY_NAME[law.law]
    expression = _find_expression(law, kind)
    form, arguments, variable, result = _find_form(kind)
    sizes = [key for key in law.parameters if key in expression.split_names and key in SIZES]
    others = [key for key in law.parameters if key in expression.split_names and key not in SIZES]
    constants = expression.text.replace("x0", repr(law.knots[0]))
    names = ", ".join([*sizes, *others])
    is_filter = form == "FILTER"
    return TEMPLATE.format(
        title=f"{kind.quantity.words[0].upper()}{kind.quantity.words[1:]} over the "
        f"{kind.along.words}, as a {law.shape}.",
        sentence=law.sentence,
        arguments=arguments,
        names=names,
        returns=f"{kind.quantity.words} as it acts",
        variable=variable,
        expression=constants,
        result=result,
        inverse=INVERSE.format(names=names) if is_filter else "",
        name=name,
        place=kind.place.name,
        form=form,
        more="    memory=lambda h: 0,\n    inverse=inverse,\n" if is_filter else "",
        parameters="".join(_write_parameter(key, law, key in SIZES) for key in [*sizes, *others]),
        words=f"{kind.quantity.words[0].upper()}{kind.quantity.words[1:]} over the "
        f"{kind.along.words}: {', '.join(f'{key} {{{key}}}' for key in [*sizes, *others])}.",
        formula=law.formula.replace('"', "'"),
    )


class _Expression:
    """Hold an expression and the names in it."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.split_names = set(re.findall(r"[a-z_]\w*", text))


def _find_expression(law: MeasuredLaw, kind: LawKind) -> _Expression:
    """Return the formula of a law without what the constants of the rig stand for."""
    if not law.shape:
        raise WrongUse(
            f"{law.law}: expected a law with a formula, found a curve without a formula: "
            "keep it as a measured law of the twin file"
        )
    turn = TURN.fullmatch(law.shape)
    if turn:
        times = f"{float(turn[1] or 1)} * at"
        text = f"sine * sin_cos({times})[0] + cosine * sin_cos({times})[1]"
    else:
        text = EXPRESSIONS[law.shape]
    has_offset = kind.role in KEEPS_OFFSET and law.shape != "constant"
    if has_offset and "offset" in law.parameters and law.parameters["offset"].value:
        text = f"offset + {text}"
    return _Expression(text)


def _find_form(kind: LawKind) -> tuple[str, str, str, str]:
    """Return form, arguments, variable and result of an effect that does what a law does."""
    state = {
        Variable.POSITION: "x",
        Variable.VELOCITY: "v",
        Variable.ANGLE: "th",
        Variable.RATE: "w",
    }
    if kind.role in (Role.FORCE, Role.TORQUE) and kind.variable in state:
        return "FORCE", "x, v, th, w", state[kind.variable], "value"
    if kind.role in (Role.CART_DRAG, Role.POLE_DRAG) and kind.variable in state:
        speed = "v" if kind.role is Role.CART_DRAG else "w"
        return "FORCE", "x, v, th, w", state[kind.variable], f"-value * {speed}"
    if kind.role in (Role.CART_ONE_WAY, Role.POLE_ONE_WAY) and kind.variable in state:
        speed = "v" if kind.role is Role.CART_ONE_WAY else "w"
        return "FORCE", "x, v, th, w", state[kind.variable], f"value * abs({speed})"
    own = {
        (Role.CART_DRY, Variable.POSITION): "position",
        (Role.CART_DRY, Variable.VELOCITY): "speed",
        (Role.POLE_DRY, Variable.ANGLE): "position",
        (Role.POLE_DRY, Variable.RATE): "speed",
    }
    if (kind.role, kind.variable) in own:
        return "DRY", "speed, position", own[kind.role, kind.variable], "max(value, 0.0)"
    if kind.role is Role.COMMAND:
        return "FILTER", "u, memory, h, t", "u", "u + value"
    if (kind.role, kind.variable) == (Role.GAIN, Variable.TIME):
        return "FILTER", "u, memory, h, t", "t", "u * (1.0 + value)"
    raise WrongUse(
        f"{kind.name}: expected a law that an effect can hold (of state or command), found a law "
        "of another kind: keep it as a measured law of the twin file"
    )


def _write_parameter(key: str, law: MeasuredLaw, is_size: bool) -> str:
    """Return the line of a parameter; a search starts from what was measured, and beside it."""
    value, unit = law.parameters[key].value, law.parameters[key].unit
    if is_size:
        probes = f"({value!r}, {-value!r}, {0.3 * value!r}, {-0.3 * value!r})"
        return f'        Parameter("{key}", "{unit}", 0.0, -1e6, 1e6, {probes}),\n'
    low = "1e-6" if key in NOT_ZERO and value > 0 else "-1e6"
    high = "-1e-6" if key in NOT_ZERO and value < 0 else "1e6"
    probes = f"({value!r}, {0.6 * value!r}, {1.6 * value!r})"
    return (
        f'        Parameter("{key}", "{unit}", {value!r}, {low}, {high}, {probes}, shape=True),\n'
    )

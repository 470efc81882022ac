"""Read a launch file as `ros2 launch` does: which programs it would start, and with what.

Anything that is not known here is an error, so that a file cannot use what its tests do not
understand.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

SRC = Path(__file__).parents[2] / "src"
LAUNCH = SRC / "pendulum_bridge" / "launch"
TRUE, FALSE = ("true", "True", "1"), ("false", "False", "0")
TYPES = {
    "str": str,
    "float": float,
    "int": int,
    "bool": lambda text: {"true": True, "false": False}[text.lower()],
}


@dataclass(frozen=True)
class Argument:
    """One `<arg>` that is declared."""

    name: str
    description: str
    default: str | None
    choices: tuple[str, ...]


@dataclass(frozen=True)
class Process:
    """One program that would be started. parameters: files and mappings, the later ones win."""

    package: str
    executable: str
    is_node: bool
    namespace: str = ""
    name: str = ""
    arguments: tuple[str, ...] = ()
    parameters: tuple[Path | dict[str, Any], ...] = ()
    ends_all: bool = False


@dataclass
class Launch:
    """What a launch file declares and would start."""

    arguments: dict[str, Argument] = field(default_factory=dict)
    processes: list[Process] = field(default_factory=list)
    fails_with_parts: bool = False

    def of(self, executable: str) -> list[Process]:
        return [process for process in self.processes if process.executable == executable]


def read(name: str, **given: object) -> Launch:
    """Read launch/NAME.launch.xml; raise AssertionError for what `ros2 launch` would refuse."""
    launch = Launch()
    _visit(
        ET.parse(LAUNCH / f"{name}.launch.xml").getroot(),
        {key: str(value) for key, value in given.items()},
        launch,
    )
    return launch


def _visit(parent: ET.Element, scope: dict[str, str], launch: Launch, inner: bool = False) -> None:
    """Visit the tags of a file or a group in order; names that are set last until its end."""
    for element in parent:
        attributes = dict(element.attrib)
        condition = _condition(attributes.pop("if", None), scope) and not _condition(
            attributes.pop("unless", "false"), scope
        )
        if condition:
            VISITORS[element.tag](element, attributes, scope, launch, inner)


def _condition(text: str | None, scope: dict[str, str]) -> bool:
    value = "true" if text is None else expanded(text, scope)
    assert value in TRUE + FALSE, f"expected true or false, found {value!r}"
    return value in TRUE


def _arg(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    known = {"name", "default", "description"}
    assert set(attributes) <= known and all(each.tag == "choice" for each in element), ET.tostring(
        element
    )
    choices = tuple(each.attrib["value"] for each in element)
    name, default = attributes["name"], attributes.get("default")
    if not inner:
        launch.arguments[name] = Argument(
            name, attributes.get("description", ""), default, choices
        )
    if name not in scope:
        assert default is not None, f"argument {name} was not given"
        scope[name] = expanded(default, scope)
    assert not choices or scope[name] in choices, (
        f"{name}: expected one of {choices}, found {scope[name]!r}"
    )


def _let(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    assert set(attributes) == {"name", "value"}, ET.tostring(element)
    scope[attributes["name"]] = expanded(attributes["value"], scope)


def _group(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    assert not attributes, ET.tostring(element)
    _visit(element, dict(scope), launch, inner)


def _include(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    assert set(attributes) == {"file"} and all(each.tag == "arg" for each in element), ET.tostring(
        element
    )
    file = Path(expanded(attributes["file"], scope))
    if file.suffix == ".py":
        assert file.is_file() and not len(element)
        launch.fails_with_parts = True
        return
    root = ET.parse(file).getroot()
    declared = {each.attrib["name"]: each for each in root.iterfind("arg")}
    handed = {each.attrib["name"]: expanded(each.attrib["value"], scope) for each in element}
    for (
        name,
        argument,
    ) in (
        declared.items()
    ):  # what has a default may come from the surroundings, what has none may not
        assert name in handed or "default" in argument.attrib, (
            f"{file}: argument {name} is not handed on"
        )
    scope.update(handed)
    _visit(root, scope, launch, inner=True)


def _executable(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    assert set(attributes) <= {"cmd", "name", "output", "on_exit"} and not len(element), (
        ET.tostring(element)
    )
    program, *arguments = _words(attributes["cmd"], scope)
    package, executable = Path(program).parent.name, Path(program).name
    launch.processes.append(
        Process(
            package, executable, False, arguments=tuple(arguments), ends_all=_ends_all(attributes)
        )
    )


def _node(
    element: ET.Element,
    attributes: dict[str, str],
    scope: dict[str, str],
    launch: Launch,
    inner: bool,
) -> None:
    known = {"pkg", "exec", "name", "namespace", "args", "ros_args", "output", "on_exit"}
    assert set(attributes) <= known and {each.tag for each in element} <= {"param"}, ET.tostring(
        element
    )
    launch.processes.append(
        Process(
            expanded(attributes["pkg"], scope),
            expanded(attributes["exec"], scope),
            True,
            "/" + expanded(attributes.get("namespace", ""), scope).strip("/"),
            expanded(attributes.get("name", ""), scope),
            tuple(_words(attributes.get("args", ""), scope)),
            (
                *_parameter_files(attributes.get("ros_args", ""), scope),
                *(_parameter(each, scope) for each in element),
            ),
            _ends_all(attributes),
        )
    )


def _ends_all(attributes: dict[str, str]) -> bool:
    assert attributes.get("on_exit", "shutdown") == "shutdown", (
        attributes
    )  # there is no other value
    return "on_exit" in attributes


def _parameter_files(text: str, scope: dict[str, str]) -> list[Path]:
    """Return the files of ROS arguments; they come before the parameters of tags."""
    words = _words(text, scope)
    assert set(words[::2]) <= {"--params-file"} and len(words) % 2 == 0, text
    return [Path(word) for word in words[1::2]]


def _parameter(element: ET.Element, scope: dict[str, str]) -> dict[str, Any]:
    # not <param from=...>: launch drops a file that is missing, and the defaults hold
    assert {"name", "value"} <= set(element.attrib) <= {"name", "value", "type"}, ET.tostring(
        element
    )
    text = expanded(element.attrib["value"], scope)
    read_value = TYPES[element.attrib["type"]] if "type" in element.attrib else yaml.safe_load
    return {element.attrib["name"]: read_value(text)}


VISITORS = {
    "arg": _arg,
    "let": _let,
    "group": _group,
    "include": _include,
    "executable": _executable,
    "node": _node,
}


def _words(text: str, scope: dict[str, str]) -> list[str]:
    """Split a command line at spaces of the text; what a substitution gives is never split."""
    marked = [
        (part if kind == "text" else part.replace(" ", "\0")) for kind, part in _parts(text, scope)
    ]
    return [word.replace("\0", " ") for word in "".join(marked).split()]


def expanded(text: str, scope: dict[str, str]) -> str:
    """Return text with its substitutions carried out."""
    return "".join(part for _, part in _parts(text, scope))


def _parts(text: str, scope: dict[str, str]) -> Iterator[tuple[str, str]]:
    at = 0
    while at < len(text):
        start = text.find("$(", at)
        if start < 0:
            yield "text", text[at:]
            return
        if start > at:
            yield "text", text[at:start]
        at = _closing(text, start + 2)
        yield "value", _substituted(text[start + 2 : at - 1], scope)


def _closing(text: str, at: int) -> int:
    """Return where the substitution that is open at a place has ended."""
    depth = 1
    while depth:
        assert at < len(text), f"a substitution in {text!r} has no end"
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
    return at


def _substituted(call: str, scope: dict[str, str]) -> str:
    name, _, rest = call.partition(" ")
    assert name in SUBSTITUTIONS, f"unknown substitution {name}"
    count, carry_out = SUBSTITUTIONS[name]
    arguments = [expanded(each, scope) for each in _arguments(rest)]
    assert len(arguments) == count, f"$({call}): expected {count} arguments"
    return carry_out(scope, *arguments)


def _arguments(text: str) -> list[str]:
    """Split at spaces outside of substitutions and single quotes; the quotes go."""
    found, start, at, quoted = [], 0, 0, False
    while at < len(text):
        if text.startswith("$(", at) and not quoted:
            at = _closing(text, at + 2)
            continue
        if text[at] == "'":
            quoted = not quoted
        elif text[at] == " " and not quoted:
            found.append(text[start:at])
            start = at + 1
        at += 1
    return [each[1:-1] if each.startswith("'") else each for each in [*found, text[start:]]]


def _var(scope: dict[str, str], name: str) -> str:
    assert name in scope, f"$(var {name}): no such argument"
    return scope[name]


def _same(scope: dict[str, str], left: str, right: str) -> str:
    return str(left == right).lower()


# In the source tree a package's folder has what its share folder has once installed.
SUBSTITUTIONS = {
    "var": (1, _var),
    "find-pkg-share": (1, lambda scope, package: str(SRC / package)),
    "exec-in-pkg": (2, lambda scope, executable, package: f"lib/{package}/{executable}"),
    "equals": (2, _same),
    "not": (1, lambda scope, value: str(not _condition(value, scope)).lower()),
    "and": (2, lambda scope, *both: str(all(_condition(each, scope) for each in both)).lower()),
    "command": (1, lambda scope, line: f"output of {line}"),
}

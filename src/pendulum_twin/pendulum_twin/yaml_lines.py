"""Find the line of a YAML file that a message is about.

Messages on the values of a file name the place before what was expected: "rig: cart_mass_kg:
expected ...", "effects: cogging: unknown key x; ...", "phases[3] (chirp): to_hz: expected ...". A
place may leave out its beginning: "cart_mass_kg: expected ..." is the key of that name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import yaml

from pendulum_twin.strict_yaml import LOADER

Place = tuple[str, ...]

SENTENCE = re.compile(
    r"^(?P<place>.*?)(?:: )?(?:expected (?P<schema>schema:)?|unknown (?:key|effect|law) )"
)
NAME = re.compile(r"unknown (?:key|effect|law) ([^;\s]+)")
FILES = ("twin file", "plan file")  # the place of a key at the top
ENTRY = re.compile(r"^(\w+)\[(\d+)\](?: \(\w+\))?$")


def find_line(text: str, message: str) -> int | None:
    """Return the line, from 1, of the key that a message names; None where it names none.

    text: a YAML document that has been parsed without an error.
    message: why its content was refused.
    """
    place = _read_place(message)
    lines = dict(_list_lines(yaml.compose(text, Loader=LOADER), ())) if place else {}
    while place:
        line = next((n for path, n in lines.items() if path[-len(place) :] == place), None)
        if line is not None:
            return line
        place = place[:-1]  # a key that is missing: its block
    return None


def _read_place(message: str) -> Place:
    """Return the keys that lead to what a message is about; nothing where it says no place."""
    sentence = SENTENCE.match(message)
    if sentence is None:
        return ()
    place: list[str] = []
    for part in filter(None, sentence["place"].split(": ")):
        entry = ENTRY.match(part)
        place += [entry[1], entry[2]] if entry else [part]
    name = NAME.search(message)
    if name is not None:
        place = [*(part for part in place if part not in FILES), name[1]]
    elif sentence["schema"]:
        place = ["schema"]
    return tuple(place)


def _list_lines(node: yaml.Node | None, path: Place) -> Iterator[tuple[Place, int]]:
    """Yield the path of every key and list entry with its line."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*path, str(key.value))
            yield inner, key.start_mark.line + 1
            yield from _list_lines(value, inner)
    elif isinstance(node, yaml.SequenceNode):
        for k, value in enumerate(node.value):
            inner = (*path, str(k))
            yield inner, value.start_mark.line + 1
            yield from _list_lines(value, inner)

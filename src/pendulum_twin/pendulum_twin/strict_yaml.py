"""Read and write YAML without its traps: names, texts, numbers, booleans, lists and mappings.

The parser is libyaml's (PyYAML); what its events mean is decided here, by the core schema of YAML
1.2 (section 10.3.2) without octal, hexadecimal, infinite and undefined numbers: what is written
so is text, and who expects a number refuses it. Keys are text as they stand.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

from pendulum_twin.errors import BadInputError

# Every finite decimal number that Python, C or MATLAB prints: 5e-05, 1.E+5, +3., .5. No integer
# with a leading zero: 017 is 15 to some readers and 17 to others.
_MANTISSA = r"(?:0|[1-9][0-9]*|[0-9]+\.[0-9]*|\.[0-9]+)"
NUMBER = re.compile(rf"[-+]?{_MANTISSA}(?:[eE][-+]?[0-9]+)?")
INTEGER = re.compile(r"[-+]?[0-9]+")
WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
DEEPEST_NESTING = 20  # brackets in brackets; the deepest file of this workspace has 6

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # libyaml may be missing


def parse_yaml(text: str) -> Any:
    """Return what a text of YAML holds: mappings, lists, texts, numbers, booleans and None.

    Raises BadInputError, with the line where it is known, for what is no YAML, a key that stands
    twice, aliases and anchors (a few lines of them expand to gigabytes), tags, more than one
    document, and deep nesting.
    """
    try:
        events = iter(yaml.parse(text, Loader=LOADER))
        values = [_build(e, events, 0) for e in events if isinstance(e, yaml.NodeEvent)]
    except (yaml.YAMLError, UnicodeEncodeError) as error:
        raise BadInputError(f"expected YAML, found {_describe_error(error)}") from error
    if len(values) > 1:
        raise BadInputError(f"expected one YAML document, found {len(values)}: leave out '---'")
    return values[0] if values else None


def format_yaml(value: object, **style: Any) -> str:
    """Return the YAML text from which `parse_yaml` reads the value back.

    style: of `yaml.dump`, such as `width`.
    """
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False, **style)


class _Dumper(yaml.SafeDumper):
    """Write text that reads as a number in quotes, and equal values twice instead of aliases."""

    def ignore_aliases(self, data: object) -> bool:
        return True


_Dumper.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(NUMBER.pattern + r"\Z"), list("-+.0123456789")
)


def _build(event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> Any:
    """Return the value that begins with an event; take the events that belong to it."""
    _check_node(event, depth)
    if isinstance(event, yaml.MappingStartEvent):
        return _build_mapping(events, depth)
    if isinstance(event, yaml.SequenceStartEvent):
        return [_build(entry, events, depth + 1) for entry in _take_entries(events)]
    assert isinstance(event, yaml.ScalarEvent)
    return read_plain(event.value) if event.implicit[0] else event.value


def _build_mapping(events: Iterator[yaml.Event], depth: int) -> dict[str, Any]:
    mapping: dict[str, Any] = {}
    for key in _take_entries(events):
        _check_node(key, depth)
        if not isinstance(key, yaml.ScalarEvent):
            raise BadInputError(f"{_locate(key)}: expected a name as key, found a list or mapping")
        if key.value in mapping:
            raise BadInputError(
                f"{_locate(key)}: expected each key once, found {key.value[:60]} twice: "
                "take one of them out"
            )
        mapping[key.value] = _build(next(events), events, depth + 1)
    return mapping


def _take_entries(events: Iterator[yaml.Event]) -> Iterator[yaml.Event]:
    """Yield the event at which each entry of a list or mapping begins, until its end."""
    for event in events:
        if isinstance(event, yaml.CollectionEndEvent):
            return
        yield event


def read_plain(text: str) -> Any:
    """Return the value of a word without quotes: number, boolean, None, or the text itself."""
    if text in WORDS:
        return WORDS[text]
    if not NUMBER.fullmatch(text):
        return text
    if INTEGER.fullmatch(text) and len(text) < 1000:  # Python refuses to read longer integers
        return int(text)
    return float(text)


def _check_node(event: yaml.Event, depth: int) -> None:
    """Raise BadInputError for an alias, an anchor, a tag, or nesting that is too deep."""
    if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
        raise BadInputError(
            f"{_locate(event)}: expected values written out, found the YAML alias or anchor "
            f"{str(getattr(event, 'anchor', ''))[:60]}: write the value in its place"
        )
    if getattr(event, "tag", None) is not None:
        raise BadInputError(
            f"{_locate(event)}: expected plain values, found the YAML tag "
            f"{str(getattr(event, 'tag', ''))[:60]}: leave it out"
        )
    if depth > DEEPEST_NESTING:
        raise BadInputError(
            f"{_locate(event)}: expected at most {DEEPEST_NESTING} levels of nesting, found more"
        )


def _locate(event: yaml.Event) -> str:
    mark = event.start_mark
    return "expected YAML" if mark is None else f"line {mark.line + 1}"


def _describe_error(error: Exception) -> str:
    """Return the parser's own words, with the line where it stopped."""
    mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
    words = str(problem or str(error).splitlines()[0])
    return words if mark is None else f"on line {mark.line + 1}: {words}"

"""Read and write plan files: what to play on a rig, phase by phase.

The format:

    schema: pendulum_plan/1
    name: friction            # optional
    rate_hz: 100              # samples a second, 20 to 1000; optional, 100
    limit: 0.3                # largest command (PWM fraction); optional, the rig's own limit
    phases:                   # one after another, at most an hour in all
      - {kind: push}
      - {kind: chirp, seconds: 20, from_hz: 0.3, to_hz: 3, amplitude: 0.3}
      - {kind: samples, commands: [0.1, 0.1, -0.1, -0.1, 0]}
      - {kind: rest, seconds: 3, centred: true}

Keys of the kinds, with their defaults in brackets:

    push        seconds (1.5)
    rest        seconds, centred (false)
    chirp       seconds, from_hz, to_hz, amplitude, centred (true)
    multisine   seconds, amplitude, tones_hz (8 tones from 0.31 to 3.37), seed (0), centred (true)
    steps       seconds, amplitude, hold_s (0.45), seed (0), centred (true)
    free_decay  seconds, amplitude, swings (2)
    samples     commands, centred (true)
    standard    seconds (60, at least 40), seed (0)

- `amplitude` is the largest command. Below some frequency the rail is too short for it: there the
  phase is weaker, so that the cart would keep within a third of the rail each way. Steps are made
  shorter instead. `samples` are sent as they stand.
- An amplitude or command beyond the limit is refused and not clipped: a clipped plan would be
  another experiment.
- `centred`: a weak push towards the middle is added to each command (the sum stays within the
  limit). A push shows in which direction a command moves the cart: a plan in which anything is
  centred begins with `push` or `standard`. A plan without a push is sent exactly as it stands, and
  is stopped when the cart comes too far out.
- A plan should end in `rest`, for at its end the command is 0 and a fast cart rolls on.

An unknown key, a missing key or a wrong value is refused with the key's name, what was expected
and what was found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, fields, replace
from pathlib import Path
from reprlib import repr as shown
from typing import Any

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_yaml_as, write_atomically
from pendulum_twin.plans.excitation import SLOWEST_HZ, Excitation, Stretch, compose_plan
from pendulum_twin.plans.plan_keys import check_range
from pendulum_twin.plans.plan_phases import BEGINNINGS, KINDS, LONGEST_S, MOST_SAMPLES, Phase
from pendulum_twin.plans.waveforms import Envelope
from pendulum_twin.rig import describe_unknown_key
from pendulum_twin.strict_yaml import format_yaml
from pendulum_twin.suggest import add_hint

SCHEMA = "pendulum_plan/1"
KEYS = ("schema", "name", "rate_hz", "limit", "phases")
FASTEST_HZ = 1000.0
MOST_PHASES = 1000
MOST_BYTES = 25 * MOST_SAMPLES  # a command as Python prints it takes up to 24
NAMES = {kind: name for name, kind in KINDS.items()}


@dataclass(frozen=True)
class Plan:
    """Hold a plan as its file has it; a wrong value raises BadInputError.

    phases: in order.
    name: of the plan.
    rate_hz: samples a second.
    limit: largest command, PWM fraction; None for the rig's own.
    """

    phases: tuple[Phase, ...]
    name: str = "plan"
    rate_hz: float = 100.0
    limit: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "rate_hz", check_range("rate_hz", self.rate_hz, SLOWEST_HZ, FASTEST_HZ)
        )
        if self.limit is not None:
            object.__setattr__(self, "limit", check_range("limit", self.limit, 1e-6, 1e6))
        if not self.phases:
            raise BadInputError("phases: expected at least one phase, found none")

    @property
    def pushed(self) -> bool:
        """Return whether it begins with the push that shows the direction of the cart."""
        return isinstance(self.phases[0], BEGINNINGS)

    def to_mapping(self) -> dict[str, Any]:
        """Return the plan as the plan file holds it."""
        head: dict[str, Any] = {"schema": SCHEMA, "name": self.name, "rate_hz": self.rate_hz}
        if self.limit is not None:
            head["limit"] = self.limit
        phases = [{"kind": NAMES[type(p)], **_list_tuples(asdict(p))} for p in self.phases]
        return {**head, "phases": phases}


def make_excitation(plan: Plan, room: Envelope) -> Excitation:
    """Return what to play of a plan on a rig.

    Raises BadInputError naming the key that the rig does not allow, and for a plan that centres
    without a push before.
    """
    limit = room.limit if plan.limit is None else plan.limit
    if limit > room.limit:
        raise BadInputError(f"limit: expected at most the rig's {room.limit:g}, found {limit:g}")
    room = replace(room, limit=limit)
    stretches: list[Stretch] = []
    for k, phase in enumerate(plan.phases):
        try:
            stretches += phase.make_stretches(room, plan.rate_hz)
        except BadInputError as error:
            raise BadInputError(f"{_format_place(k, NAMES[type(phase)])}: {error}") from error
    samples = sum(len(stretch.commands) for stretch in stretches)
    if samples > min(MOST_SAMPLES, LONGEST_S * plan.rate_hz):
        raise BadInputError(
            f"phases: expected at most {LONGEST_S:g} s and {MOST_SAMPLES} samples in all, found "
            f"{samples / plan.rate_hz:g} s and {samples}"
        )
    if not plan.pushed and any(stretch.centred for stretch in stretches):
        raise BadInputError(
            "phases[0]: expected kind push or standard, "
            f"found {NAMES[type(plan.phases[0])]}: what is centred needs to know "
            "which way a command moves the cart; "
            "put {kind: push} first, or give centred: false everywhere"
        )
    return compose_plan(stretches, plan.rate_hz, room, plan.pushed)


def parse_plan(mapping: object) -> Plan:
    """Return the plan that a plan file holds; raise BadInputError naming the key that is wrong."""
    if not isinstance(mapping, Mapping):
        raise BadInputError(f"expected a mapping with schema and phases, found {shown(mapping)}")
    for key in mapping:
        if key not in KEYS:
            raise BadInputError(describe_unknown_key("plan file", str(key), KEYS))
    if mapping.get("schema") != SCHEMA:
        raise BadInputError(f"schema: expected {SCHEMA}, found {shown(mapping.get('schema'))}")
    phases = mapping.get("phases")
    if not isinstance(phases, list) or not 1 <= len(phases) <= MOST_PHASES:
        raise BadInputError(
            f"phases: expected a list of 1 to {MOST_PHASES} phases, found {shown(phases)}"
        )
    name = mapping.get("name", "plan")
    if not isinstance(name, str):
        raise BadInputError(f"name: expected text, found {shown(name)}")
    parsed = tuple(_parse_phase(k, phase) for k, phase in enumerate(phases))
    return Plan(parsed, name, mapping.get("rate_hz", 100.0), mapping.get("limit"))


def read_plan(path: str | Path) -> Plan:
    """Return the plan in a YAML file; raise BadInputError, with path and line, for none."""
    return read_yaml_as(parse_plan, path, "a plan file", MOST_BYTES)


def load_plan(path: str | Path, room: Envelope = Envelope()) -> Excitation:  # noqa: B008 (frozen)
    """Return what to play of a plan file on a rig; raise BadInputError with path and key."""
    plan = read_plan(path)
    try:
        return make_excitation(plan, room)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error


def save_plan(plan: Plan, path: str | Path) -> None:
    """Write the plan file whole or not at all."""
    write_atomically(
        path,
        format_yaml(plan.to_mapping(), default_flow_style=None, width=120),
    )


def _parse_phase(k: int, mapping: object) -> Phase:
    """Return phase k of a plan file."""
    if not isinstance(mapping, Mapping):
        raise BadInputError(f"phases[{k}]: expected a mapping with kind, found {shown(mapping)}")
    name = mapping.get("kind")
    if not isinstance(name, str) or name not in KINDS:
        raise BadInputError(
            f"phases[{k}]: kind: expected one of {', '.join(KINDS)}, found {shown(name)}"
            f"{add_hint(name, KINDS)}"
        )
    where, keys = _format_place(k, name), {key.name: key for key in fields(KINDS[name])}
    values = {key: value for key, value in mapping.items() if key != "kind"}
    for key in values:
        if key not in keys:
            raise BadInputError(describe_unknown_key(where, str(key), ("kind", *keys)))
    for key, field in keys.items():
        if field.default is MISSING and key not in values:
            raise BadInputError(f"{where}: expected {key}, found it missing")
    try:
        return KINDS[name](**values)
    except BadInputError as error:
        raise BadInputError(f"{where}: {error}") from error


def _format_place(k: int, kind: str) -> str:
    return f"phases[{k}] ({kind})"


def _list_tuples(values: dict[str, Any]) -> dict[str, Any]:
    """Return values with lists for tuples, which YAML can hold."""
    return {
        key: list(value) if isinstance(value, tuple) else value for key, value in values.items()
    }

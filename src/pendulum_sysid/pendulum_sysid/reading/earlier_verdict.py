"""Read an earlier diagnosis back from its files: `verdict.json`, and `twin.yaml` beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.errors import FileError, UnusableRecording
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form
from pendulum_twin.files import read_json_object
from pendulum_twin.model import Twin, load_twin

SCHEMA = "pendulum_verdict/1"


@dataclass(frozen=True)
class EarlierVerdict:
    """Hold what an earlier diagnosis ended with.

    twin: the improved twin.
    rivals: effect -> the effects that it could not be told from.
    """

    twin: Twin
    rivals: dict[str, tuple[str, ...]]

    @property
    def effects(self) -> tuple[str, ...]:
        """Return the effects that a fit to positions can turn."""
        return tuple(name for name in self.twin.effects if BY_NAME[name].form is not Form.REPORT)


def read_verdict(path: Path) -> EarlierVerdict:
    """Read an earlier diagnosis.

    Raises FileError when its files are missing, UnusableRecording when it found the recording
    unusable.
    """
    mapping = read_json_object(path, SCHEMA, "a verdict")
    try:
        rivals = {
            str(entry["effect"]): tuple(map(str, entry["cannot_be_told_from"]))
            for entry in mapping["missing_physics"]
        }
        outcome = mapping["outcome"]
    except (KeyError, TypeError) as error:
        raise FileError(
            f"{path}: expected a verdict with schema {SCHEMA}, found {error} missing or odd"
        ) from error
    if outcome == "unusable":
        raise UnusableRecording(
            f"{path}: expected a verdict on a usable recording, found 'unusable': record again"
        )
    return EarlierVerdict(load_twin(path.parent / "twin.yaml"), rivals)

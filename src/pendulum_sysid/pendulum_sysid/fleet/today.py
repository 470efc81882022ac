"""The twin of today: a rig's twin file with the sizes pooled since their last change."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.comparison import list_effects
from pendulum_sysid.fleet.history import PRESENCE, History
from pendulum_sysid.fleet.pooling import Pooled
from pendulum_sysid.fleet.rows import RIG
from pendulum_sysid.fleet.store import Store
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin


def make_twin_of_today(store: Store, history: History) -> tuple[Twin, dict[str, Pooled]]:
    """Return a rig's twin of today, and the sizes that it has from its recordings.

    Effects that a diagnosis named in most recordings since they changed are added; an effect of a
    recording, and not of the rig (a slip of the encoder), is left out. All else is as in the twin
    that the work started from: sizes that no recording fixes, measured laws, and spreads.

    Raises FileError when the rig gave no answer, or its pooled constants are none of a body.
    """
    if history.recordings.empty:
        raise FileError(
            f"{store.address}: expected recordings of {history.rig} that gave an answer, found "
            "none: nothing is known of this rig"
        )
    digest = str(history.recordings["twin"].iloc[-1])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "twin.yaml"
        file.write_bytes(store.read_twin(digest))
        twin = load_twin(file)
    named = list_effects(history)
    _check_known(store, named)
    kept = set(twin.effects) | {name for name in named if not BY_NAME[name].of_recording}
    constants: dict[str, float] = {}
    effects = {name: dict(values) for name, values in twin.effects.items()}
    effects |= {name: {} for name in kept if name not in effects}
    used: dict[str, Pooled] = {}
    for size in history.sizes:
        if size.parameter == PRESENCE or (size.owner != RIG and size.owner not in kept):
            continue
        used[size.name] = size.today
        value = size.today.value
        if size.owner == RIG:
            constants[size.parameter] = value
        else:
            effects[size.owner][size.parameter] = value
    for name in effects:  # what no recording fixes
        neutral = {p.name: p.neutral for p in BY_NAME[name].parameters}
        effects[name] = neutral | effects[name]
    try:
        rig = replace(twin.rig, **constants)
        return replace(twin, name=history.rig, rig=rig, effects=effects), used
    except BadInputError as error:
        raise FileError(
            f"{store.address}: expected pooled constants of {history.rig} that a body can have, "
            f"found otherwise: {error}"
        ) from error


def _check_known(store: Store, names: Sequence[str]) -> None:
    """Raise FileError for an effect of the user's own that is not loaded here."""
    unknown = [name for name in names if name not in BY_NAME]
    if unknown:
        raise FileError(
            f"{store.address}: expected effects of the catalogue or of your own, found "
            f"{', '.join(unknown)}: give --effects FOLDER as the run did"
        )

"""What a proof is to do, and the guard that a folder holds one proof only."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.telling.output_files import format_json, write_text
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest, describe_read_error

SCHEMA = "pendulum_proof_plan/1"
FILE = "plan.json"
TRIAL_LIMIT_S = 3600.0  # of one trial with its rivals
MAY_DIFFER = (
    "trials",
    "rivals",
    "processes",
    "scheduler",
)  # from run to run in one folder


@dataclass(frozen=True)
class Plan:
    """Hold the options of a proof; None leaves a choice to the recorder of trials.

    trials: how many.
    seed: what they are drawn from.
    pole_counts: counts a turn of the pole's encoder.
    seconds: length of each recording, s.
    closed_loop: whether to record a controller at work instead of the standard plan.
    relay: whether that controller knows three commands alone.
    pairs: whether every rig is recorded and diagnosed a second time, under another plan.
    rest: whether small physics that nobody asks for is always on, as on real rigs.
    kinds: "KIND:SHARE,...".
    twin: file of the nominal rig.
    rivals: names of the rivals to ask as well, those that name effects and those that predict.
    dose_tries: recordings of each effect at each size; 0 for no dose-response.
    processes: trials worked on side by side.
    scheduler: address of a Dask cluster that works on them; None for a local cluster.
    """

    trials: int
    seed: int
    pole_counts: int | None = None
    seconds: float | None = None
    closed_loop: bool = False
    relay: bool = False
    pairs: bool = False
    rest: bool = False
    kinds: str | None = None
    twin: str | None = None
    rivals: tuple[str, ...] = ()
    dose_tries: int = 0
    processes: int = 2
    scheduler: str | None = None

    @property
    def engine(self) -> Engine:
        """Return where the trials are worked on."""
        return Engine(self.processes, self.scheduler, time_limit_s=TRIAL_LIMIT_S)

    def list_recorder_options(self) -> list[str]:
        """Return the options of the recorder's command line that all trials of the plan share."""
        options = {
            "--seed": self.seed,
            "--pole-counts": self.pole_counts,
            "--seconds": self.seconds,
            "--twin": self.twin,
        }
        words = [
            word
            for name, value in options.items()
            if value is not None
            for word in (name, str(value))
        ]
        flags = {
            "--closed-loop": self.closed_loop,
            "--relay": self.relay,
            "--pairs": self.pairs,
            "--rest": self.rest,
        }
        return [*words, *(name for name, chosen in flags.items() if chosen)]


def claim_folder(plan: Plan, folder: Path) -> None:
    """Write the plan into the folder; raise BadInputError when another proof began there.

    A dose-response may be added to a proof and left out again, but its tries stay as many: they
    decide which effects are tried at smaller sizes, and these take turns by the trial's number.
    """
    path = folder / FILE
    planned = {"schema": SCHEMA, **asdict(plan)}
    tries = _read(path).get("dose_tries") if path.exists() else None
    if tries and not plan.dose_tries:
        planned["dose_tries"] = tries
    usual = asdict(Plan(plan.trials, plan.seed))  # an earlier version knew fewer options
    claim_file(path, planned, MAY_DIFFER if tries else (*MAY_DIFFER, "dose_tries"), usual)


def claim_file(
    path: Path,
    planned: dict[str, Any],
    may_differ: Sequence[str] = (),
    usual: Mapping[str, Any] = {},
) -> None:
    """Write what is planned for a folder into a file of it.

    planned: in JSON's types; of a twin's path the file keeps the digest as well, for it is the
        content of the twin, and not its name, that trials are drawn from.
    may_differ: keys whose values may change from run to run in one folder.
    usual: values of keys that the file may lack.
    Raises BadInputError when the file holds another plan.
    """
    if planned.get("twin") is not None:
        planned = {**planned, "twin_digest": _compute_twin_digest(planned["twin"])}
    if path.exists():
        earlier = _read(path)
        if {"twin", "twin_digest"} <= earlier.keys() & planned.keys():
            _check_twin(path, earlier, planned)
            may_differ = (*may_differ, "twin")
        for key in [key for key in planned if key not in (*may_differ, "twin_digest")]:
            began = earlier.get(key, usual.get(key))
            if began != planned[key]:
                raise BadInputError(
                    f"{path.parent}: expected the proof that began there with "
                    f"{key} = {began}, found {key} = {planned[key]}: "
                    "name another folder"
                )
    write_text(path, format_json(planned) + "\n")


def _compute_twin_digest(twin: str) -> str:
    try:
        return compute_digest([Path(twin)])
    except OSError as error:
        raise BadInputError(
            f"{twin}: expected a twin file, but it cannot be read: {describe_read_error(error)}"
        ) from error


def _check_twin(path: Path, earlier: dict[str, Any], planned: dict[str, Any]) -> None:
    if earlier["twin_digest"] != planned["twin_digest"]:
        raise BadInputError(
            f"{path.parent}: expected the twin that the proof there began with (then in "
            f"{earlier['twin']}), found another content in {planned['twin']}: name another folder"
        )


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInputError(
            f"{path}: expected the plan of a proof, but it cannot be read: "
            f"{describe_read_error(error)}"
        ) from error
    if not isinstance(content, dict):
        raise BadInputError(
            f"{path}: expected the plan of a proof, found another file: name another folder"
        )
    return content

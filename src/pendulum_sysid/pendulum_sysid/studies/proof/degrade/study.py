"""The study of degraded recordings: every kind, on every rig, diagnosed and scored."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fleet.engine import Engine, SchedulerLost, open_client, run_tasks
from pendulum_sysid.fleet.warm_up import compile_kernels
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Outcome
from pendulum_sysid.studies.proof.degrade.bases import list_recorder_options
from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME, DEGRADATIONS, Degradation
from pendulum_sysid.studies.proof.degrade.score import Score, score_answer
from pendulum_sysid.studies.proof.plan import claim_file
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.record_trial import check_options, check_recorder, record_trial
from pendulum_sysid.studies.proof.records import OpenedTrial
from pendulum_sysid.telling.output_files import check_folder, format_json, write_text
from pendulum_twin.errors import BadInputError, WorkerError
from pendulum_twin.model import load_twin
from pendulum_twin.suggest import add_hint

SCHEMA = "pendulum_degraded/1"
STUDY_SCHEMA, STUDY_FILE = "pendulum_degraded_plan/1", "degraded_plan.json"
KINDS_OF_RIG = "nothing:1,single:1,pair:1"
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Row:
    """Hold one degraded recording and its answer.

    kind: name of the degradation.
    rig: nothing, single or pair.
    trial: number of the rig.
    concealed: effects that were concealed.
    outcome: as in verdict.json.
    score: right, says less or wrong.
    why: behind the score, in words.
    reported: kinds of data quality that the verdict reports.
    sentence: the verdict's.
    """

    kind: str
    rig: str
    trial: int
    concealed: tuple[str, ...]
    outcome: str
    score: str
    why: str
    reported: tuple[str, ...]
    sentence: str


@dataclass(frozen=True)
class Study:
    """Hold what is to be done.

    trials: rigs, with no, one and two effects concealed in turns.
    seed: what rigs and degradations are drawn from.
    kinds: names of the degradations.
    engine: where the recordings are worked on.
    twin: file of the nominal rig; None for the recorder's own.
    """

    trials: int
    seed: int
    kinds: tuple[str, ...] = tuple(BY_NAME)
    engine: Engine = field(default_factory=Engine)
    twin: str | None = None

    @property
    def recorder_options(self) -> list[str]:
        """Return the options of the recorder's command line that all rigs share."""
        twin = [] if self.twin is None else ["--twin", self.twin]
        return ["--seed", str(self.seed), "--kinds", KINDS_OF_RIG, *twin]


def run_study(study: Study, folder: Path, progress: Progress) -> list[Row]:
    """Return a row for each kind and rig, and write them to folder/degraded.json.

    What an earlier run has answered in the folder is not done again.

    Raises BadInputError when rigs cannot be recorded or the folder holds a study of another seed
    or twin, and WrongUse when a kind is unknown.
    """
    check_recorder()
    check_folder(folder)
    for name in study.kinds:
        if name not in BY_NAME:
            known = ", ".join(BY_NAME)
            raise WrongUse(
                f"--degrade: expected kinds among {known}, found {name!r}{add_hint(name, BY_NAME)}"
            )
    check_options(study.recorder_options)
    drawn_from = {"schema": STUDY_SCHEMA, "seed": study.seed, "twin": study.twin}
    claim_file(folder / STUDY_FILE, drawn_from)
    rows: list[Row] = []
    works = [
        RigWork(study, folder.absolute(), base, number)
        for number in range(study.trials)
        for base in sorted({BY_NAME[name].base for name in study.kinds})
    ]
    try:
        with open_client(study.engine, compile_kernels) as client:
            endings = run_tasks(client, _answer_rig, works, study.engine.time_limit_s)
            for done, ending in enumerate(endings, 1):
                if ending.error is not None:
                    raise ending.error
                if ending.put_aside:
                    raise WorkerError(f"rig {ending.item.number}: {ending.put_aside}")
                rows += ending.result or []
                wrong = sum(row.score == Score.WRONG.value for row in rows)
                progress(f"{done}/{len(works)}: {len(rows)} answers, {wrong} wrong")
    except SchedulerLost as error:
        raise WorkerError(str(error)) from error
    order = list(BY_NAME)
    rows.sort(key=lambda row: (order.index(row.kind), row.trial))
    content = {"schema": SCHEMA, **asdict(study), "rows": [asdict(row) for row in rows]}
    write_text(folder / "degraded.json", format_json(content) + "\n")
    return rows


@dataclass(frozen=True)
class RigWork:
    """Hold what the answers about one rig and base need.

    folder: of the study, which coordinator and workers share.
    number: of the rig.
    """

    study: Study
    folder: Path
    base: str
    number: int


def _answer_rig(work: RigWork) -> list[Row]:
    """Return the rows of one rig and base, recorded and answered where they are not yet."""
    study, folder, base, number = work.study, work.folder, work.base, work.number
    trials = folder / base
    trials.mkdir(parents=True, exist_ok=True)
    options = [*study.recorder_options, *list_recorder_options(base, folder)]
    trial_folder = record_trial(trials, number, options)
    trial = read_trial(trial_folder)
    kinds = [d for d in DEGRADATIONS if d.base == base and d.name in study.kinds]
    return [_answer_once(trial, trial_folder, d, number, study.seed) for d in kinds]


def _answer_once(
    trial: OpenedTrial, folder: Path, degradation: Degradation, number: int, seed: int
) -> Row:
    path = folder / f"{degradation.name}.json"
    if path.exists():
        content = json.loads(path.read_text(encoding="utf-8"))
        verdict, error = content["verdict"], content["error"]
    else:
        verdict, error = answer_degraded(trial, degradation, seed)
        write_text(path, format_json({"verdict": verdict, "error": error}) + "\n")
    scored = score_answer(trial, verdict, error, load_twin(trial.twin).rig)
    return Row(
        degradation.name,
        trial.kind,
        number,
        tuple(trial.seal.effects),
        str(verdict.get("outcome", "")),
        scored.score.value,
        scored.why,
        tuple(entry["kind"] for entry in verdict.get("data_quality") or []),
        str(verdict.get("sentence", "")),
    )


def answer_degraded(
    trial: OpenedTrial, degradation: Degradation, seed: int
) -> tuple[dict[str, Any], str]:
    """Return the verdict on a trial's recording, degraded, and the error that broke it off."""
    own = zlib.crc32(degradation.name.encode())
    random = np.random.default_rng((seed, trial.seed, own))
    try:
        # the bag receives each sample as it is taken, which would tell the times that are degraded
        whole = replace(read_bag(trial.bag), state_received_s=None)
        raw = degradation.degrade(whole, random)
        recording = clean_recording(raw)
        return diagnose([recording], load_twin(trial.twin), _discard).to_dict(), ""
    except BadInputError as refusal:
        return {"outcome": Outcome.UNUSABLE.value, "sentence": str(refusal)}, ""
    except Exception as crash:  # a finding about the diagnosis, not the end of the study
        return {}, f"{type(crash).__name__}: {crash}"


def count_scores(rows: Sequence[Row]) -> dict[Score, int]:
    """Return how many answers have each score."""
    return {score: sum(row.score == score.value for row in rows) for score in Score}


def _discard(line: str) -> None:
    """Take a line of progress that nobody reads."""

"""Recordings made from the page, each followed by its diagnosis, in processes of their own.

A recording begins and ends by a button; its diagnosis follows by itself, at low priority, after
the diagnoses of earlier recordings. Nothing here waits for a program but tasks of the event loop.
"""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

from pendulum_bridge.view.child import GENTLY, GIVEN_UP_S, GRACE_S, Child, wait_for_either
from pendulum_bridge.view.samples import RecordingState, Stage
from pendulum_twin.errors import BadInputError

MOST_KEPT = 8  # recordings that the page lists
RECORDING, DIAGNOSIS = "recording", "diagnosis"  # folders of a recording's own folder
VERDICT = "verdict.json"
FILES = ("report.html", VERDICT, "twin.yaml", "next.yaml")  # of a diagnosis, that the page serves
SHARE = re.compile(r"\s*(\d{1,3}) %, ")  # how a diagnosis says the share that is done


@dataclass(frozen=True)
class Programs:
    """Hold the command lines that recordings need.

    record: makes that of the recorder, of the folder to write.
    ready: what the recorder says once it records.
    diagnose: makes that of a diagnosis, of a recording and the folder to write; None for no
        diagnosis.
    environment: variables of all of them.
    """

    record: Callable[[Path], Sequence[str]]
    ready: str
    diagnose: Callable[[Path, Path], Sequence[str]] | None
    environment: Mapping[str, str]


class Recordings:
    """Make recordings below a folder; the page's event loop alone calls this.

    folder: gets a folder a recording.
    programs: what makes a recording and its diagnosis.
    tell: is called with all recordings, the newest first, whenever one has changed.
    clock: returns monotonic time, s.
    """

    def __init__(
        self,
        folder: Path,
        programs: Programs,
        tell: Callable[[tuple[RecordingState, ...]], None],
        clock: Callable[[], float],
    ) -> None:
        self._folder, self._programs, self._tell, self._clock = folder, programs, tell, clock
        self._states: dict[str, RecordingState] = {}  # the oldest first
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._given_up: set[str] = set()  # recordings whose diagnosis a person ends now
        self._under_way: tuple[str, asyncio.Event] | None = None
        self._turn = asyncio.Lock()  # of diagnoses: each would take the cores from the other

    def begin(self) -> str:
        """Begin a recording and return its name; raise BadInputError when one is under way."""
        if self._under_way is not None:
            raise BadInputError(f"{self._under_way[0]} is being recorded already: end it first")
        name, ended = self._choose_name(), asyncio.Event()
        self._under_way = name, ended
        self._states[name] = RecordingState(name, Stage.STARTING, self._clock())
        for old in list(self._states)[:-MOST_KEPT]:
            if self._states[old].stage.over:
                del self._states[old]
        self._tasks[name] = asyncio.create_task(self._run(name, ended))
        self._tasks[name].add_done_callback(lambda _: self._tasks.pop(name))
        self._change(name)
        return name

    def end(self) -> str:
        """End the recording under way and return its name; raise BadInputError without one."""
        if self._under_way is None:
            raise BadInputError("nothing is being recorded")
        name, ended = self._under_way
        ended.set()
        return name

    def give_up(self, name: str) -> None:
        """Give up the diagnosis of a recording, which stays; raise BadInputError without one."""
        state = self._states.get(name)
        if state is None or not state.stage.may_be_given_up or name in self._given_up:
            raise BadInputError(f"expected a recording that is being diagnosed, found {name}")
        self._given_up.add(name)
        self._tasks[name].cancel()

    def find_file(self, name: str, file: str) -> Path | None:
        """Return a file of a recording's diagnosis; None for all that the page does not offer."""
        state = self._states.get(name)
        return self._folder / name / DIAGNOSIS / file if state and file in state.files else None

    async def close(self) -> None:
        """End all programs: a recording keeps what it has, a diagnosis is given up."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _run(self, name: str, ended: asyncio.Event) -> None:
        try:
            try:
                await self._record(name, ended)
            finally:
                self._under_way = None
            await self._diagnose(name)
        except asyncio.CancelledError:
            if name not in self._given_up:
                raise  # the page ends
            stays = f"the recording stays in {self._folder / name / RECORDING}"
            self._change(
                name, stage=Stage.GIVEN_UP, sentence=f"The diagnosis was given up; {stays}"
            )
        except BadInputError as error:
            self._change(name, stage=Stage.FAILED, sentence=str(error))
        except Exception as error:  # a task that ends unseen would leave the page waiting
            self._change(name, stage=Stage.FAILED, sentence=f"internal error: {error!r}")
        finally:
            self._given_up.discard(name)

    async def _record(self, name: str, ended: asyncio.Event) -> None:
        folder, ready = self._folder / name, asyncio.Event()
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise BadInputError(
                f"{folder}: expected a folder that can be made: {error.strerror}"
            ) from error

        def hear(line: str) -> None:
            if self._programs.ready in line:
                ready.set()

        command = self._programs.record(folder / RECORDING)
        child = await Child.start(command, self._programs.environment, hear)
        try:
            if await wait_for_either(ready, child):  # a signal before would end it unfinished
                self._change(name, stage=Stage.RECORDING, began_s=self._clock())
                await wait_for_either(ended, child)
                child.interrupt()
            self._change(name, stage=Stage.CLOSING)
            if status := await child.wait():
                why = child.last_line or f"the recorder ended with status {status}"
                stays = f"; what was recorded stays in {folder / RECORDING}"
                raise BadInputError(why + (stays if ready.is_set() else ""))
        finally:
            await child.end()

    async def _diagnose(self, name: str) -> None:
        recording, out = self._folder / name / RECORDING, self._folder / name / DIAGNOSIS
        if self._programs.diagnose is None:
            self._change(name, stage=Stage.KEPT, sentence=f"kept in {recording}")
            return
        self._change(name, stage=Stage.WAITING)

        def hear(line: str) -> None:
            share = SHARE.match(line)
            changes: dict[str, Any] = {"share": int(share[1]) / 100} if share else {}
            self._change(name, sentence=line.strip(), **changes)

        async with self._turn:
            self._change(name, stage=Stage.DIAGNOSING, share=0.0)
            command = [*GENTLY, *self._programs.diagnose(recording, out)]
            child = await Child.start(command, self._programs.environment, hear)
            try:
                await child.wait()
            finally:
                await child.end(GIVEN_UP_S if name in self._given_up else GRACE_S)
            verdict = await asyncio.to_thread(_read_verdict, out)
            if verdict is None:
                raise BadInputError(child.last_line or "the diagnosis ended without a verdict")
            outcome, sentence = verdict
            files = tuple(file for file in FILES if (out / file).exists())
            self._change(
                name, stage=Stage.DONE, share=1.0, outcome=outcome, sentence=sentence, files=files
            )

    def _choose_name(self) -> str:
        name = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        same = 1
        while (self._folder / name).exists() or name in self._states:
            same += 1
            name = f"{name[:19]}_{same}"
        return name

    def _change(self, name: str, **changes: Any) -> None:
        self._states[name] = replace(self._states[name], **changes)
        self._tell(tuple(reversed(self._states.values())))


def _read_verdict(folder: Path) -> tuple[str, str] | None:
    """Return outcome and sentence of a diagnosis; None when it has written no verdict."""
    with suppress(OSError, ValueError, KeyError, TypeError):
        verdict = json.loads((folder / VERDICT).read_text(encoding="utf-8"))
        return str(verdict["outcome"]), str(verdict["sentence"])
    return None

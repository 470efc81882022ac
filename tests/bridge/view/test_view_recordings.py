"""Recordings from the page: programs of their own, in order, ended with the page."""

import asyncio
import os
from collections.abc import Callable, Collection, Coroutine
from pathlib import Path
from time import monotonic
from typing import Any

import pytest
from support.page_programs import DIAGNOSE, RECORD, let_diagnoses_end, make_fake_programs

from pendulum_bridge.view.child import Child
from pendulum_bridge.view.recordings import MOST_KEPT, Programs, Recordings
from pendulum_bridge.view.samples import RecordingState, Stage
from pendulum_twin.errors import BadInputError

DEADLINE_S = 120.0


class Desk:
    """Recordings below a folder, and what was told of them."""

    def __init__(self, folder: Path, programs: Programs) -> None:
        self.told: list[tuple[RecordingState, ...]] = []
        self.recordings = Recordings(folder, programs, self.told.append, monotonic)

    @property
    def newest(self) -> RecordingState:
        return self.told[-1][0]

    async def until(self, done: Callable[[], Any]) -> None:
        """Look again and again while the loop's tasks go on; fail at the deadline."""
        end = monotonic() + DEADLINE_S
        while not done():
            assert monotonic() < end, self.told[-1]
            await asyncio.sleep(0.01)

    async def reach(self, *stages: Stage) -> None:
        await self.until(lambda: self.newest.stage in stages)


def run_desk(
    folder: Path, programs: Programs, play: Callable[[Desk], Coroutine[Any, Any, None]]
) -> Desk:
    """Play with a desk in an event loop, and close it."""

    async def play_and_close() -> Desk:
        desk = Desk(folder, programs)
        try:
            await asyncio.wait_for(play(desk), 2 * DEADLINE_S)
        finally:
            await desk.recordings.close()
        return desk

    return asyncio.run(play_and_close())


async def record(desk: Desk) -> str:
    name = desk.recordings.begin()
    await desk.reach(Stage.RECORDING)
    assert desk.recordings.end() == name
    return name


def test_a_recording_is_followed_by_its_verdict(tmp_path: Path) -> None:
    async def play(desk: Desk) -> None:
        name = await record(desk)
        await desk.until(lambda: desk.newest.share == 0.4)
        assert desk.newest.stage is Stage.DIAGNOSING and desk.newest.files == ()
        assert desk.newest.sentence == "40 %, about 25 s left: growing the set"
        assert desk.recordings.find_file(name, "report.html") is None  # not before it is whole
        let_diagnoses_end(tmp_path)
        await desk.reach(Stage.DONE)
        report = desk.recordings.find_file(name, "report.html")
        assert report == tmp_path / name / "diagnosis" / "report.html" and report.exists()
        for other, file in ((name, "../recording/bag"), ("..", "go"), (name, "twin.yaml")):
            assert desk.recordings.find_file(other, file) is None

    desk = run_desk(tmp_path, make_fake_programs(), play)
    done = desk.newest
    assert (done.outcome, done.share) == ("named", 1.0)
    assert done.sentence == "Dry friction <b>holds</b>, nice 10."  # it yields to all else
    stages = list(dict.fromkeys(told[0].stage for told in desk.told))
    otherwise = Stage.KEPT, Stage.GIVEN_UP, Stage.FAILED
    assert stages == [stage for stage in Stage if stage not in otherwise]


def test_one_recording_at_a_time_and_diagnoses_in_turn(tmp_path: Path) -> None:
    async def play(desk: Desk) -> None:
        with pytest.raises(BadInputError, match="nothing is being recorded"):
            desk.recordings.end()
        first = desk.recordings.begin()
        with pytest.raises(BadInputError, match=f"{first} is being recorded already"):
            desk.recordings.begin()
        await desk.reach(Stage.RECORDING)
        desk.recordings.end()
        await desk.reach(Stage.DIAGNOSING)
        second = await record(desk)  # while the first is diagnosed
        await desk.reach(Stage.WAITING)
        assert {each.name: each.stage for each in desk.told[-1]} == {
            second: Stage.WAITING, first: Stage.DIAGNOSING,
        }  # fmt: skip
        let_diagnoses_end(tmp_path)
        await desk.until(lambda: all(each.stage is Stage.DONE for each in desk.told[-1]))

    desk = run_desk(tmp_path, make_fake_programs(), play)
    assert all(sum(each.stage is Stage.DIAGNOSING for each in told) <= 1 for told in desk.told)


DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + DIAGNOSE


@pytest.mark.parametrize("diagnose", [DIAGNOSE, DEAF], ids=["usual", "deaf"])
def test_a_diagnosis_is_given_up_and_the_next_goes_on(tmp_path: Path, diagnose: str) -> None:
    others = list_children()

    async def play(desk: Desk) -> None:
        first = await record(desk)
        await desk.until(lambda: desk.newest.share == 0.4)
        second = await record(desk)
        await desk.reach(Stage.WAITING)
        before = list_children(others)
        assert before
        desk.recordings.give_up(first)
        with pytest.raises(BadInputError, match=f"being diagnosed, found {first}"):
            desk.recordings.give_up(first)  # it ends already
        await desk.reach(Stage.DIAGNOSING)  # its turn has come
        assert not before & list_children()
        given_up = desk.told[-1][1]
        assert (given_up.name, given_up.stage, given_up.files) == (first, Stage.GIVEN_UP, ())
        kept = tmp_path / first / "recording"
        assert given_up.sentence == f"The diagnosis was given up; the recording stays in {kept}"
        assert (kept / "bag").read_text() == "whole"
        assert not (tmp_path / first / "diagnosis").exists()
        let_diagnoses_end(tmp_path)
        await desk.reach(Stage.DONE)
        for name in (second, "..", "no such"):
            with pytest.raises(BadInputError, match="expected a recording that is being"):
                desk.recordings.give_up(name)

    run_desk(tmp_path, make_fake_programs(diagnose=diagnose), play)


def test_a_diagnosis_that_waits_is_given_up_before_its_turn(tmp_path: Path) -> None:
    async def play(desk: Desk) -> None:
        first = await record(desk)
        await desk.reach(Stage.DIAGNOSING)
        second = await record(desk)
        await desk.reach(Stage.WAITING)
        desk.recordings.give_up(second)
        await desk.reach(Stage.GIVEN_UP)
        assert desk.told[-1][1].stage is Stage.DIAGNOSING  # the first is left alone
        assert desk.told[-1][1].name == first
        let_diagnoses_end(tmp_path)
        await desk.until(lambda: desk.told[-1][1].stage is Stage.DONE)

    run_desk(tmp_path, make_fake_programs(), play)


FAILS = "import sys; print('recorder_node: out: expected a new folder'); sys.exit(1)"
FAILS_LATER = RECORD + "\nprint('recorder_node: the disk is full')\nsys.exit(1)"
NO_VERDICT = "import sys; print('sysid: rig.yaml: unknown key', file=sys.stderr); sys.exit(1)"


@pytest.mark.parametrize(
    ("programs", "sentence"),
    [
        (make_fake_programs(record=FAILS), "recorder_node: out: expected a new folder"),
        (make_fake_programs(record=FAILS_LATER), "the disk is full; what was recorded stays in"),
        (make_fake_programs(diagnose=NO_VERDICT), "sysid: rig.yaml: unknown key"),
        (
            Programs(lambda folder: ["no_such_program"], "", None, dict(os.environ)),
            "expected the program no_such_program, but it cannot be run",
        ),
    ],
    ids=["recorder", "disk", "diagnosis", "missing"],
)
def test_what_fails_is_told_and_the_next_recording_begins(
    tmp_path: Path, programs: Programs, sentence: str
) -> None:
    async def play(desk: Desk) -> None:
        for _ in range(2):
            desk.recordings.begin()
            await desk.reach(Stage.RECORDING, Stage.FAILED)
            if desk.newest.stage is Stage.RECORDING:
                desk.recordings.end()
            await desk.reach(Stage.FAILED)
            assert sentence in desk.newest.sentence

    run_desk(tmp_path, programs, play)


def test_without_a_diagnosis_the_recording_is_kept_and_old_rows_go(tmp_path: Path) -> None:
    async def play(desk: Desk) -> None:
        for _ in range(MOST_KEPT + 2):
            await record(desk)
            await desk.reach(Stage.KEPT)

    desk = run_desk(tmp_path, make_fake_programs(diagnose=None), play)
    assert len(desk.told[-1]) == MOST_KEPT
    assert len(list(tmp_path.iterdir())) == MOST_KEPT + 2  # all stay on the disk
    assert desk.newest.sentence == f"kept in {tmp_path / desk.newest.name / 'recording'}"


@pytest.mark.parametrize("stage", [Stage.RECORDING, Stage.DIAGNOSING])
def test_programs_end_with_the_page(tmp_path: Path, stage: Stage) -> None:
    children: set[int] = set()
    others = list_children()

    async def play(desk: Desk) -> None:
        desk.recordings.begin()
        await desk.reach(Stage.RECORDING)
        if stage is Stage.DIAGNOSING:
            desk.recordings.end()
            await desk.until(lambda: desk.newest.share > 0.0)
        children.update(list_children(others))

    run_desk(tmp_path, make_fake_programs(), play)
    assert children and not children & list_children()
    assert (next(tmp_path.iterdir()) / "recording/bag").read_text() == "whole"


def list_children(but: Collection[int] = ()) -> set[int]:
    """Return the process numbers of this process's children, but for these.

    Other tests in this process may have left some, as the tracker of multiprocessing's resources.
    """
    folders = Path(f"/proc/{os.getpid()}/task").iterdir()
    children = {int(n) for folder in folders for n in (folder / "children").read_text().split()}
    return children.difference(but)


# It ends by SIGKILL only: its sleep is longer than any deadline here.
DEAF = """import signal, time
signal.signal(2, signal.SIG_IGN)
print('deaf', flush=True)
time.sleep(600)"""


async def start_deaf_child() -> Child:
    """Return a program that ignores SIGINT already."""
    heard = asyncio.Event()
    program = make_fake_programs(DEAF).record(Path("unused"))
    child = await Child.start(program, dict(os.environ), lambda line: heard.set())
    await asyncio.wait_for(heard.wait(), DEADLINE_S)
    return child


def test_a_program_that_ignores_the_signal_is_killed() -> None:
    async def play() -> int | None:
        child = await start_deaf_child()
        await child.end(grace_s=0.1)
        return child._process.returncode

    assert asyncio.run(play()) == -9


def test_a_program_is_killed_when_its_end_is_no_longer_waited_for() -> None:
    async def play() -> int:
        child = await start_deaf_child()
        ending = asyncio.create_task(child.end(grace_s=DEADLINE_S))
        await asyncio.sleep(0)  # no time: the task begins to end the child, and waits
        ending.cancel()
        await asyncio.gather(ending, return_exceptions=True)
        return await asyncio.wait_for(child._process.wait(), DEADLINE_S)

    assert asyncio.run(play()) == -9

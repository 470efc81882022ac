"""Progress: a share and the time left, never silent for long, colours on a terminal only."""

import io
import re
import threading
from collections.abc import Callable

import pytest

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.verbs import progress, said
from pendulum_sysid.verbs.progress import BEGINS, Course, Progress


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def run_stages(
    stages: list[Stage], seconds: Callable[[Stage], float]
) -> list[tuple[float, float]]:
    """Return share and time left, asked ten times a stage."""
    clock = Clock()
    course, asked = Course(clock), []
    for stage in stages:
        course.enter(stage)
        for _ in range(10):
            share, left_s = course.share, course.left_s
            assert share is not None and left_s is not None
            asked.append((share, left_s))
            clock.now += seconds(stage) / 10
    return asked


def test_shares_of_stages_rise_in_their_order() -> None:
    assert tuple(BEGINS) == tuple(Stage)
    assert list(BEGINS.values()) == sorted(set(BEGINS.values())) and max(BEGINS.values()) < 1.0


@pytest.mark.parametrize("factor", [0.2, 1.0, 5.0])
def test_the_share_rises_and_the_time_left_fits_a_steady_pace(factor: float) -> None:
    ends = [*list(BEGINS.values())[1:], 1.0]
    lasts = {
        stage: (end - begin) * 40.0 * factor
        for (stage, begin), end in zip(BEGINS.items(), ends, strict=True)
    }
    asked = run_stages([stage for stage in Stage if stage is not Stage.LAWS], lasts.__getitem__)
    shares = [share for share, _ in asked]
    assert shares == sorted(shares) and min(shares) >= 0.0 and max(shares) < 1.0
    late = [(share, left_s) for share, left_s in asked if share > 0.6]
    for share, left_s in late:
        assert left_s == pytest.approx((1.0 - share) * 40.0 * factor, rel=0.2)


def test_laws_take_as_long_as_all_before_and_count_anew() -> None:
    clock = Clock()
    course = Course(clock)
    course.enter(Stage.JUDGING)
    clock.now += 30.0
    course.enter(Stage.LAWS)
    total_s = 30.0 * (1.0 + progress.LAWS_FACTOR)
    assert course.share == pytest.approx(30.0 / total_s)
    clock.now += 15.0
    assert course.left_s == pytest.approx(total_s - 45.0)
    clock.now += 45.0
    assert course.left_s == pytest.approx(progress.LAWS_LEFT * 60.0), "many laws: more are likely"
    assert course.share == pytest.approx(progress.LAWS_NEARLY)
    course.enter(Stage.WRITING)
    assert course.share == BEGINS[Stage.WRITING]


def test_a_stage_that_comes_again_does_not_turn_the_share_back() -> None:
    clock = Clock()
    course = Course(clock)
    for stage in (Stage.READING, Stage.LONG, Stage.GROWING, Stage.POLE):
        course.enter(stage)
    assert course.share == BEGINS[Stage.LONG]


def test_the_time_left_of_a_stage_that_outlasts_its_share_does_not_stand_still() -> None:
    clock = Clock()
    course, asked = Course(clock), []
    course.enter(Stage.READING)
    clock.now += 10.0
    course.enter(Stage.GROWING)
    for _ in range(100):
        clock.now += 1.0
        share, left_s = course.share, course.left_s
        assert share is not None and left_s is not None
        asked.append((share, left_s))
    shares = [share for share, _ in asked]
    assert shares == sorted(shares) and shares[-1] < BEGINS[Stage.SUBSETS]
    for k in (49, 99):  # 60 s and 110 s for at most 36 % of the work
        share, left_s = asked[k]
        assert left_s == pytest.approx(
            (k + 11.0) * (1.0 - share) / BEGINS[Stage.SUBSETS], rel=0.01
        )


def test_a_long_stage_never_reaches_the_next() -> None:
    clock = Clock()
    course = Course(clock)
    course.enter(Stage.CONSTANTS)
    clock.now += 1e6
    assert course.share is not None and course.share < BEGINS[Stage.POLE]


def test_elsewhere_than_on_a_terminal_lines_are_plain() -> None:
    stream = io.StringIO()
    with Progress(stream, quiet=False) as shown:
        shown.follow_stages()
        shown.report(Stage.READING)  # is said only if it takes long
        assert stream.getvalue() == ""
        shown.report(Stage.CONSTANTS)
        shown.report("misfit 2.00 with no effects")
    lines = stream.getvalue().splitlines()
    assert re.fullmatch(r" +\d %, about \d+ s left: fitting the rig's constants alone", lines[0])
    assert re.fullmatch(r" +\d+ %, about \d+ s left: misfit 2.00 with no effects", lines[1])
    assert "\x1b" not in stream.getvalue() and "\r" not in stream.getvalue()


def test_a_terminal_has_a_last_line_that_goes_away(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    stream = Terminal()
    with Progress(stream, quiet=False) as shown:
        shown.follow_stages()
        shown.report(Stage.CONSTANTS)
        assert re.search(r"\r\x1b\[K[|/\\-]   \d %, about \d+ s left: fitting", stream.getvalue())
        assert "\x1b[2mfitting" in stream.getvalue()
    assert stream.getvalue().endswith(said.CLEAR_LINE)
    before = stream.getvalue()
    shown.report("too late")
    assert stream.getvalue() == before


def test_a_command_without_stages_says_neither_a_share_nor_a_time_left() -> None:
    """A fit said 2 %, and a time left that grew, for it entered the first stage only."""
    stream = io.StringIO()
    with Progress(stream, quiet=False) as shown:
        shown.report(Stage.READING)  # the step, should it take long
        shown.report("fitting 12 windows")
        shown.report(Stage.PLANNING)
    assert stream.getvalue().splitlines() == ["fitting 12 windows", Stage.PLANNING]


def test_silence_is_broken_by_plain_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "SILENCE_S", 0.02)
    monkeypatch.setattr(progress, "REDRAW_S", 0.005)
    written = io.StringIO()
    with Progress(written, quiet=False) as shown:
        shown.follow_stages()
        shown.report(Stage.GROWING)
        assert shown._thread is not None
        while written.getvalue().count("so far)") < 3 and shown._thread.is_alive():
            shown._thread.join(0.005)  # polls; a thread that died would end it
    assert written.getvalue().count("asking what is missing") >= 4


@pytest.mark.parametrize(("has_stages", "is_due"), [(True, True), (False, False)])
def test_a_diagnosis_is_never_silent_for_long_and_a_study_of_hours_may_be(
    has_stages: bool, is_due: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock()
    monkeypatch.setattr(progress.time, "monotonic", clock)
    shown = Progress(io.StringIO(), quiet=False)
    if has_stages:
        shown.follow_stages()
    clock.now += 3600.0
    shown.report(Stage.GROWING if has_stages else "3/600 rigs")
    clock.now += progress.SILENCE_S
    assert shown._is_silent_for_long() is is_due
    clock.now += progress.LONGEST_SILENCE_S
    assert shown._is_silent_for_long()


def test_nothing_is_said_of_a_command_that_has_no_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "START_S", 0.0)
    monkeypatch.setattr(progress, "SILENCE_S", 0.0)
    monkeypatch.setattr(progress, "REDRAW_S", 0.001)
    beats = threading.Event()
    written = io.StringIO()
    with Progress(written, quiet=False) as shown:
        due = shown._is_silent_for_long
        monkeypatch.setattr(shown, "_is_silent_for_long", lambda: (beats.set(), due())[1])
        assert beats.wait(60.0)
    assert written.getvalue() == ""


def test_quiet_says_nothing() -> None:
    stream = Terminal()
    with Progress(stream, quiet=True) as shown:
        shown.report(Stage.READING)
        shown.report("a line")
    assert stream.getvalue() == ""


def test_a_reader_that_leaves_does_not_end_the_work() -> None:
    class Closed(io.StringIO):
        def write(self, text: str) -> int:
            raise BrokenPipeError

    with Progress(Closed(), quiet=False) as shown:
        shown.report(Stage.CONSTANTS)
        shown.report("a line")


@pytest.mark.parametrize(
    ("variable", "value", "coloured"),
    [("TERM", "xterm", True), ("TERM", "dumb", False), ("NO_COLOR", "1", False)],
)
def test_colours_are_for_terminals_that_want_them(
    variable: str, value: str, coloured: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv(variable, value)
    assert (said.paint("yes", said.Colour.GOOD, Terminal()) != "yes") == coloured
    assert said.paint("yes", said.Colour.GOOD, io.StringIO()) == "yes"

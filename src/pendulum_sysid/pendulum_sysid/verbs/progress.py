"""Say on stderr how far a command has come, so that it is never silent for long.

On a terminal the last line shows the step at hand, and changes all the time. Elsewhere plain lines
come, with such a line whenever nothing else was said. A command that follows the stages of a
diagnosis says the share that is done and the time left as well.
"""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable
from typing import Self, TextIO

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.verbs.said import CLEAR_LINE, Colour, is_terminal, paint

SILENCE_S = 2.0  # longest without a line where stderr is no terminal; 3 on a busy computer
SILENCE_SHARE = 0.05  # of the time so far, in a study: hours do not fill its log
LONGEST_SILENCE_S = 60.0  # in a study
START_S = 2.75  # longest until the first line: what ends sooner says its one sentence only
REDRAW_S = 0.25  # from one state of the last line to the next on a terminal
STARTING = "starting"
SPINNER = "|/-\\"
NEARLY = 0.95  # of a stage's share, which a stage that takes long never leaves by itself

# Share of a diagnosis that is done when a stage begins: means over three emulated rigs, a minute
# at 100 Hz each (`python -m pendulum_sysid.studies.stage_shares`), in which nothing was left
# without a name. They differ by 0.15 from recording to recording.
BEGINS = {
    Stage.READING: 0.0,
    Stage.PREPARING: 0.02,
    Stage.CONSTANTS: 0.05,
    Stage.POLE: 0.2,
    Stage.GROWING: 0.27,
    Stage.SUBSETS: 0.36,
    Stage.LONG: 0.44,
    Stage.NAMING: 0.59,
    Stage.TIES: 0.72,
    Stage.REPLICATING: 0.74,
    Stage.JUDGING: 0.76,
    Stage.PLANNING: 0.9,
    Stage.LAWS: 0.92,
    Stage.WRITING: 0.98,
}
# Where something has no name, measuring it takes so many times as long as all before: 0.6, 0.8 and
# 9 times on the three rigs of that study that needed it. Its share counts anew.
LAWS_FACTOR = 1.0
# Laws that take longer are many. Half of the time that they took so far is then told as left: an
# estimate, too short early and about right at the end (the INTECO minute). The share stands.
LAWS_LEFT = 0.5
LAWS_NEARLY = (1.0 + LAWS_LEFT + LAWS_FACTOR) / ((1.0 + LAWS_LEFT) * (1.0 + LAWS_FACTOR))
USUAL_S = 40.0  # of a whole diagnosis, before its own pace is known
SHORTEST_S = 1e-3  # of any work; a pace of 0 s would leave no share
TRUSTED_SHARE = 0.3  # done, after which the pace so far tells the rest
# Said only if they take long: what cannot be read or used ends in its one sentence on stderr.
UNSPOKEN = (Stage.READING, Stage.PREPARING, Stage.WRITING)
ORDER = tuple(BEGINS)


class Course:
    """Estimate the share of a diagnosis that is done, and the time left, from its stages.

    clock: returns monotonic time, s.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._entered = clock()
        self._stage: Stage | None = None

    def enter(self, stage: Stage) -> None:
        """Note that a stage begins; an earlier stage that comes again counts for nothing."""
        if self._stage is None or ORDER.index(stage) > ORDER.index(self._stage):
            self._stage, self._entered = stage, self._clock()

    @property
    def share(self) -> float | None:
        """Return the share that is done, 0 to 1; None before the first stage."""
        if self._stage is None:
            return None
        begin, end = self._span
        passed = self._clock() - self._entered
        if self._stage is Stage.LAWS:
            return min((self._clock() - self._began) / self._pace_s, LAWS_NEARLY)
        return begin + min(passed / self._pace_s, NEARLY * (end - begin))

    @property
    def left_s(self) -> float | None:
        """Return the time left, s; None before the first stage."""
        share = self.share
        if share is None:
            return None
        if self._stage is Stage.LAWS:
            now = self._clock()
            return max(self._pace_s - (now - self._began), LAWS_LEFT * (now - self._entered))
        return self._pace_s * (1.0 - share)

    @property
    def _span(self) -> tuple[float, float]:
        """Return the shares at which the present stage begins and ends."""
        assert self._stage is not None
        following = ORDER.index(self._stage) + 1
        end = BEGINS[ORDER[following]] if following < len(ORDER) else 1.0
        return BEGINS[self._stage], end

    @property
    def _pace_s(self) -> float:
        """Return the time of the whole at the present pace: at first the usual, then this one.

        A stage that outlasts its share says by itself that the pace is slower.
        """
        begin, end = self._span
        before_s = max(self._entered - self._began, SHORTEST_S)
        if self._stage is Stage.LAWS:
            return (1.0 + LAWS_FACTOR) * before_s
        return max(_mix_pace(before_s, begin), _mix_pace(self._clock() - self._began, end))


def _mix_pace(elapsed_s: float, share: float) -> float:
    """Return the time of the whole, s, when a share of it took so long: early on the usual."""
    if share <= 0.0:
        return USUAL_S
    trust = min(share / TRUSTED_SHARE, 1.0)
    return trust * elapsed_s / share + (1.0 - trust) * USUAL_S


class Progress:
    """Show progress in a thread of its own, from `start` to `end`.

    stream: stderr.
    quiet: shows nothing at all.
    """

    def __init__(self, stream: TextIO, quiet: bool) -> None:
        self._stream, self._quiet = stream, quiet
        self._drawn = is_terminal(stream)
        self._course: Course | None = None
        self._began = time.monotonic()
        self._step, self._spoken = STARTING, time.monotonic()
        self._turns, self._has_spoken = 0, False
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        """Begin to show that the command is at work."""
        if not self._quiet:
            self._thread = threading.Thread(target=self._beat, daemon=True)
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def follow_stages(self) -> None:
        """Say the share and the time left from now on: this command reports its stages."""
        self._course = Course()

    def report(self, line: str) -> None:
        """Take a line of progress; a Stage also says how far a command with stages has come."""
        if self._course is not None and isinstance(line, Stage):
            self._course.enter(line)
        if self._quiet or self._ended.is_set():
            return
        with self._lock:
            self._step = str(line)
            if line in UNSPOKEN:
                return
            if self._drawn:
                self._write(f"{CLEAR_LINE}{paint(str(line), Colour.FAINT, self._stream)}\n")
                self._draw()
            else:
                self._write(f"{self._format_share()}{line}\n")
            self._spoken, self._has_spoken = time.monotonic(), True

    def end(self) -> None:
        """Take the last line away; what follows is the answer."""
        if self._ended.is_set() or self._thread is None:
            return
        self._ended.set()
        self._thread.join()
        if self._drawn:
            self._write(CLEAR_LINE)

    def _beat(self) -> None:
        """Keep the last line alive, or say a line before the silence is long."""
        while not self._ended.wait(REDRAW_S):
            with self._lock:
                if self._drawn:
                    self._draw()
                elif self._is_silent_for_long():
                    passed = time.monotonic() - self._began
                    self._write(f"{self._format_share()}{self._step} ({passed:.0f} s so far)\n")
                    self._spoken, self._has_spoken = time.monotonic(), True

    def _is_silent_for_long(self) -> bool:
        """Return whether a line is due where nothing is drawn; never before a stage begins."""
        if self._step is STARTING:
            return False
        now = time.monotonic()
        longest = SILENCE_S if self._has_spoken else START_S
        if self._course is None:  # a study may take hours
            longest = max(longest, min(SILENCE_SHARE * (now - self._began), LONGEST_SILENCE_S))
        return now - self._spoken > longest - REDRAW_S

    def _draw(self) -> None:
        self._turns += 1
        line = f"{SPINNER[self._turns % len(SPINNER)]} {self._format_share()}{self._step}"
        width = shutil.get_terminal_size().columns - 1
        self._write(f"{CLEAR_LINE}{line[:width]}")

    def _format_share(self) -> str:
        if self._course is None:
            return ""
        share, left_s = self._course.share, self._course.left_s
        if share is None or left_s is None:
            return ""
        return f"{100 * share:3.0f} %, about {_format_time(left_s)} left: "

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):  # the reader of stderr has gone
            self._quiet = True
            self._ended.set()


def _format_time(seconds: float) -> str:
    """Return a time as a person says it: seconds by fives, then minutes."""
    if seconds < 90.0:
        return f"{max(5 * round(seconds / 5), 5)} s"
    return f"{seconds / 60:.0f} min"

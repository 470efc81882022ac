"""How the paces keep time, on a link whose clock is made: no ROS, no waiting."""

import math
from collections import deque
from itertools import pairwise

import numpy as np
import pytest

from pendulum_rl_env.pacing.link import Received
from pendulum_rl_env.pacing.lockstep import LockstepPace
from pendulum_rl_env.pacing.real_time import RealTimePace
from pendulum_rl_env.pacing.schedule import Schedule
from pendulum_rl_env.pacing.sequence import StampSequence, compute_period_ns
from pendulum_rl_env.transport import NoAnswerError
from pendulum_twin.errors import BadInputError

MS = 1_000_000
DEPTH = 10  # of the queue of samples


class MadeRig:
    """A rig that samples every period, on a clock that only waiting or thinking moves.

    A sample's first number is its own number, its third the command held when it was taken.
    """

    name = "/rig"

    def __init__(self, period_ms: int = 10, way_ms: int = 1, ahead_ms: int = 0) -> None:
        self.period_ns, self.way_ns, self.ahead_ns = period_ms * MS, way_ms * MS, ahead_ms * MS
        self.now, self.taken, self.dead_ns = 5 * MS, 0, 10**15
        self.late: dict[int, int] = {}  # ns on top, by sample
        self.early: dict[int, int] = {}  # ns by which a sample is stamped early
        self.lost: set[int] = set()
        self.sent: list[tuple[int, float]] = []
        self.queue: deque[Received] = deque(maxlen=DEPTH)

    def send(self, command: float) -> None:
        self.sent.append((self.now, command))

    def wait(self, timeout_s: float) -> Received | None:
        end = self.now + max(math.ceil(timeout_s * 1e9), 0) + 1  # so that time goes on
        self._arrive(self.now)
        while not self.queue and self._next() <= end:
            self.now = self._next()
            self._arrive(self.now)
        if self.queue:
            return self.queue.popleft()
        self.now = end
        return None

    def think(self, seconds_ms: float) -> None:
        self.now += round(seconds_ms * MS)

    def now_s(self) -> float:
        return self.now / 1e9

    def now_ns(self) -> int:
        return self.now

    def _next(self) -> int:
        stamp = self.taken * self.period_ns
        return (
            stamp + self.way_ns + self.late.get(self.taken, 0) if stamp < self.dead_ns else 10**18
        )

    def _arrive(self, until: int) -> None:
        while self._next() <= until:
            arrival, stamp = self._next(), self.taken * self.period_ns
            heard = [command for when, command in self.sent if when < stamp]
            if self.taken not in self.lost:
                state = np.array([self.taken, 3.0, heard[-1] if heard else 0.0, 0.0])
                stamp += self.ahead_ns - self.early.get(self.taken, 0)
                self.queue.append(Received(state, stamp, arrival / 1e9))
            self.taken += 1


def begin_pace(rig: MadeRig, step_s: float = 0.03, deadline_s: float = 1.0) -> RealTimePace:
    pace = RealTimePace(rig, step_s, deadline_s)
    pace.begin(None)
    return pace


@pytest.mark.parametrize("think_ms", [0.0, 2.0, 12.0, 28.0])
def test_steps_are_a_period_apart_and_show_their_command(think_ms: float) -> None:
    rig = MadeRig()
    pace = begin_pace(rig)
    rig.think(777.0)  # no time counts between the reset and the first command
    samples = []
    for k in range(1, 200):
        samples.append(pace.exchange(k / 1000))
        assert samples[-1].state[2] == k / 1000
        rig.think(think_ms)
    assert {sample.info["dt_s"] for sample in samples} == {0.03}
    assert {
        sample.info["missed"] + sample.info["lost"] + sample.info["stale"] for sample in samples
    } == {0.0}
    assert (
        samples[-1].info["age_s"] == pytest.approx(0.001, abs=1e-6)
        and samples[-1].info["overrun_s"] == 0.0
    )
    assert samples[-1].info["latency_s"] == pytest.approx(
        ((-think_ms - 1) % 10 + 1) / 1000, abs=0.0011
    )
    assert samples[-1].stamp_s == samples[0].stamp_s + 198 * 0.03
    delay_s = (rig.sent[-1][0] - round(1e9 * samples[-2].stamp_s)) / 1e9
    assert samples[-1].info["delay_s"] == pytest.approx(delay_s, abs=1e-9)
    assert delay_s == pytest.approx((think_ms + 1.0) / 1e3, abs=1e-4)  # 1 ms of it under way


def test_a_sample_from_before_the_command_is_never_its_answer() -> None:
    rig = MadeRig(way_ms=7)  # samples under way when the command is sent
    pace = begin_pace(rig)
    for k in range(1, 50):
        before = rig.now
        sample = pace.exchange(k / 1000)
        assert sample.stamp_s * 1e9 > before and sample.state[2] == k / 1000
        rig.think(29.5)


def test_a_sample_that_waited_is_no_answer_though_its_stamp_is_later() -> None:
    rig = MadeRig(ahead_ms=5)
    pace = begin_pace(rig)
    rig.late = {rig.taken: 5 * MS}  # so the schedule is late, too
    pace.exchange(0.1)
    rig.think(33.0)
    late = pace.exchange(0.2)
    assert late.state[2] == 0.2 and late.info["overrun_s"] == 0.0


def test_a_late_caller_is_counted_and_nobody_catches_up() -> None:
    rig = MadeRig()
    pace = begin_pace(rig)
    pace.exchange(0.1)
    rig.think(500.0)
    late = pace.exchange(0.2)
    assert late.info["overrun_s"] == pytest.approx(0.47, abs=0.001) and late.info["missed"] == 1.0
    assert late.info["delay_s"] == pytest.approx(0.501, abs=0.001)
    assert (
        late.state[2] == 0.2
        and late.info["dt_s"] == pytest.approx(0.53, abs=0.011)
        and late.info["lost"] == 0.0
    )
    samples = [pace.exchange(0.3) for _ in range(20)]
    assert {sample.info["dt_s"] for sample in samples} == {0.03} and {
        sample.info["overrun_s"] for sample in samples
    } == {0.0}
    assert samples[-1].info["missed"] == 1.0


def test_a_late_sample_is_waited_for_a_period_and_no_longer() -> None:
    rig = MadeRig()
    pace = begin_pace(rig)
    first = pace.exchange(0.1)
    number = round(first.state[0])
    rig.late, rig.lost = {number + 3: 9 * MS}, {number + 6}
    steps = [pace.exchange(0.1) for _ in range(3)]
    assert [round(sample.state[0]) - number for sample in steps] == [3, 7, 9]
    assert [sample.info["lost"] for sample in steps] == [0.0, 1.0, 1.0]


@pytest.mark.parametrize("think_ms", [None, 33.5])
def test_steps_have_the_same_samples_though_their_stamps_jitter(think_ms: float | None) -> None:
    """After a late command, too, steps end where samples come, and not between two of them."""
    rig = MadeRig()
    rig.early = {number: number % 2 * MS for number in range(300)}
    pace = begin_pace(rig)
    first = pace.exchange(0.1)
    if think_ms is not None:
        rig.think(think_ms)
        first = pace.exchange(0.1)
        assert first.info["missed"] == 1.0
    samples = [first, *(pace.exchange(0.1) for _ in range(20))]
    assert {after.state[0] - before.state[0] for before, after in pairwise(samples)} == {3.0}


def test_without_samples_it_ends_at_the_deadline_and_says_so() -> None:
    rig = MadeRig()
    pace = begin_pace(rig, deadline_s=0.5)
    pace.exchange(0.1)
    rig.dead_ns = begin = rig.now
    with pytest.raises(
        NoAnswerError,
        match=r"/rig: expected a sample later than the command within 0.5 s, found none",
    ):
        pace.exchange(0.1)
    assert rig.now - begin == pytest.approx(500 * MS, abs=10)


@pytest.mark.parametrize(
    ("ahead_ms", "error", "words"),
    [
        (-5000, NoAnswerError, "found none later than [45]"),
        (5000, BadInputError, "stamped 4.999 s ahead"),
    ],
)
def test_clocks_that_differ_are_told(ahead_ms: int, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        begin_pace(MadeRig(ahead_ms=ahead_ms))


def test_what_cannot_be_used_is_refused() -> None:
    with pytest.raises(BadInputError, match="at least every 30 ms, found one every 50 ms"):
        begin_pace(MadeRig(period_ms=50))
    with pytest.raises(BadInputError, match="found a twin in lockstep: give lockstep=True"):
        RealTimePace(MadeRig(), 0.03, 1.0).begin(0)
    with pytest.raises(BadInputError, match="start twin_node with lockstep:=true"):
        LockstepPace(MadeRig(), 0.03, 1.0).begin(None)
    for pace in (RealTimePace, LockstepPace):
        with pytest.raises(BadInputError, match="expected a reset before the first command"):
            pace(MadeRig(), 0.03, 1.0).exchange(0.0)


class MadeTwin:
    """A twin in lockstep: a command makes the samples of the next row of stamps (ms), if any."""

    name = "/twin"

    def __init__(self, *rows: list[int]) -> None:
        self.rows, self.sent = deque(rows), 0
        self.queue = deque(self.rows.popleft())

    def send(self, command: float) -> None:
        self.sent += 1
        self.queue.extend(self.rows.popleft() if self.rows else [])

    def wait(self, timeout_s: float) -> Received | None:
        return (
            Received(np.full(4, self.queue[0]), self.queue.popleft() * MS, 0.0)
            if self.queue
            else None
        )

    def now_s(self) -> float:
        return 0.0

    def now_ns(self) -> int:
        return 0


@pytest.mark.parametrize(("period", "commands"), [(10, 3), (30, 1), (15, 2)])
def test_a_command_is_sent_as_often_as_a_step_has_samples(period: int, commands: int) -> None:
    twin = MadeTwin([0], *([k * period] for k in range(1, 7)))
    pace = LockstepPace(twin, 0.03, 1.0)
    assert pace.begin(0).info["dt_s"] == 0.0
    assert pace.exchange(0.1).info["dt_s"] == 0.03
    assert twin.sent == commands
    assert pace.exchange(0.1).stamp_s == 0.06


def test_samples_out_of_order_and_missing_ones_are_counted() -> None:
    twin = MadeTwin([0], [30], [30, 60], [120], [], [150])
    pace = LockstepPace(twin, 0.03, 1.0)
    pace.begin(0)
    samples = [pace.exchange(0.0) for _ in range(3)]
    assert [sample.stamp_s for sample in samples] == [0.03, 0.06, 0.12]
    assert [(sample.info["stale"], sample.info["lost"]) for sample in samples] == [
        (0, 0),
        (1, 0),
        (1, 1),
    ]
    with pytest.raises(
        NoAnswerError, match="/twin: expected an answer to a command within 1 s, found none"
    ):
        pace.exchange(0.0)
    assert pace.exchange(0.0).stamp_s == 0.15


def test_an_answer_to_somebody_else_is_not_ours() -> None:
    twin = MadeTwin([0], [30], [90])
    pace = LockstepPace(twin, 0.03, 1.0)
    pace.begin(0)
    pace.exchange(0.0)
    twin.queue.append(60)
    samples = pace.exchange(0.0)
    assert (samples.stamp_s, samples.info["stale"], samples.info["lost"]) == (0.09, 1.0, 0.0)


def test_a_step_that_is_no_whole_number_of_periods_is_refused() -> None:
    pace = LockstepPace(MadeTwin([0], [12]), 0.03, 1.0)
    pace.begin(0)
    with pytest.raises(BadInputError, match="a step of 30 ms, found samples every 12 ms"):
        pace.exchange(0.0)


def test_a_start_state_that_does_not_come_is_told() -> None:
    assert LockstepPace(MadeTwin([0, 10]), 0.03, 1.0).begin(20 * MS) is None


def test_a_schedule_does_not_drift() -> None:
    schedule = Schedule(0.03)
    schedule.start(100.0, 0)
    assert [schedule.advance(100.0 + 0.03 * k + 0.02, 0) for k in range(1000)] == [0.0] * 1000
    assert (
        schedule.end_s == pytest.approx(130.0)
        and schedule.end_ns == 30_000 * MS
        and schedule.missed == 0
    )
    assert schedule.advance(200.0, 7) == pytest.approx(200.0 - 130.03) and schedule.missed == 1
    assert schedule.end_s == 200.03 and schedule.end_ns == 7 + 30 * MS


def test_a_row_of_stamps_is_judged() -> None:
    row = StampSequence(10.0)
    assert [row.accept(stamp) for stamp in (0, 10, 21, 50, 50, 40, 58)] == [True] * 4 + [
        False
    ] * 2 + [True]
    assert (row.lost, row.stale) == (2, 2)
    assert compute_period_ns([0, 10, 20, 50, 60]) == 10.0

"""The driver without ROS and without a rig: what it sends, in which order, whatever fails."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from pendulum_bridge.driver import driver as module
from pendulum_bridge.driver.driver import DECISIONS_BETWEEN, LAST_WORDS, Driver
from pendulum_bridge.driver.waiting_samples import MOST_UNPUBLISHED
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import make_rules
from pendulum_bridge.wire.link import Arrival, Counts
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Level
from pendulum_twin.rig import Rig

HANGING = Sample(math.pi, 0.0, 0.0, 0.0)
PERIOD_S = 0.01


@dataclass
class Peer:
    """Stand for link, outlet and last word; samples queue up, and calls are kept in order."""

    waiting: deque[Arrival] = field(default_factory=deque)
    said: list[tuple] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)
    counts: Counts = field(default_factory=Counts)
    trouble: str = ""
    broken: str = ""
    fault: Reason | None = None
    replaced: int = 0
    closed: int = 0
    left_pwm: float = 0.0
    wellness: int = 0

    def send(self, command: Command) -> None:
        if self.broken:
            raise BadInputError(self.broken)
        self.sent.append(command.pwm)

    def receive_stamped(self, deadline: float) -> Arrival | None:
        return self.waiting.popleft() if self.waiting else None

    def take_waiting(self) -> list[Arrival]:
        taken = list(self.waiting)
        self.waiting.clear()
        return taken

    def drop_waiting(self) -> int:
        self.waiting.clear()
        return 0

    def alive(self) -> None:
        self.wellness += 1

    def close(self, left_pwm: float = 0.0) -> None:
        self.closed += 1
        self.left_pwm = left_pwm or self.left_pwm

    def publish_sample(self, state: RigState, stamp_ns: int) -> None:
        self.said.append(("sample", state))

    def publish_applied(self, pwm: float) -> None:
        self.said.append(("applied", pwm))

    def publish_stopped(self, latched: bool) -> None:
        self.said.append(("stopped", latched))

    def report_failure(self, error: Exception) -> None:
        self.said.append(("failed", error))


@dataclass
class Bench:
    """A driver at its peer; unless real, time stands still but for `turn`, which adds a period."""

    nominal: Rig
    real: bool = False
    now_s: float = 0.0
    peer: Peer = field(default_factory=Peer)

    def __post_init__(self) -> None:
        clock = time.monotonic if self.real else lambda: self.now_s
        self.driver = Driver(self.peer, make_rules(self.nominal), self.peer, self.peer, clock)

    def arrive(self, age_s: float = 0.0, sample: Sample = HANGING) -> None:
        self.peer.waiting.append(Arrival(sample, time.time_ns() - round(1e9 * age_s)))

    def turn(self, count: int = 1) -> None:
        for _ in range(count):
            self.now_s += PERIOD_S
            self.arrive()
            self.driver.turn()


@pytest.fixture
def bench(nominal: Rig) -> Bench:
    made = Bench(nominal)
    made.turn()
    return made


@pytest.fixture
def serving(nominal: Rig) -> Iterator[Bench]:
    made, ended = Bench(nominal, real=True), threading.Event()
    made.turn()
    thread = threading.Thread(target=made.driver.serve, args=(ended,))
    thread.start()
    yield made
    ended.set()
    thread.join()


def until(done: Callable[[], object]) -> None:
    end = time.monotonic() + 120
    while not done():
        assert time.monotonic() < end
        threading.Event().wait(0.002)


def test_a_sample_is_published_before_what_was_decided_on_it(bench: Bench) -> None:
    assert [name for name, _ in bench.peer.said] == ["sample", "applied"]
    assert bench.peer.said[0][1] == RigState(0.0, math.pi, 0.0, 0.0)
    bench.arrive(sample=Sample(pole_rad=3.0, pole_rate=0.2, cart_m=0.1, cart_velocity=-0.3))
    bench.driver.turn()
    assert bench.peer.said[-2][1] == RigState(
        cart_m=0.1, pole_rad=3.0, cart_m_s=-0.3, pole_rad_s=0.2
    )


def test_a_decision_that_was_held_up_on_its_way_is_not_sent(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.turn(2)
    bench.driver.command(0.3)

    def held_up(*arguments: object) -> object:
        decision = original(*arguments)
        monkeypatch.undo()
        bench.now_s += 1.0  # stopped (SIGSTOP) here
        return decision

    original = module.decide
    monkeypatch.setattr(module, "decide", held_up)
    bench.turn()
    assert bench.peer.sent[-2:] == [0.3, 0.0]


def test_a_command_is_sent_at_once_and_whole_though_the_sample_was_just_before(
    bench: Bench,
) -> None:
    bench.turn(2)
    bench.now_s += 0.0003
    assert bench.driver.command(0.3) is None
    assert bench.peer.sent[-1] == 0.3 and bench.peer.said[-1] == ("applied", 0.3)


def test_a_flood_of_commands_is_no_flood_for_the_rig_and_its_last_one_counts(bench: Bench) -> None:
    before = len(bench.peer.sent)
    for k in range(1000):
        bench.driver.command(0.001 * (k % 100))
    assert len(bench.peer.sent) - before == DECISIONS_BETWEEN
    bench.turn()
    assert bench.peer.sent[-1] == 0.099
    assert bench.driver.health().figures["commands"] == 1000


def test_what_is_sent_is_what_is_said_to_be_applied_in_the_same_order(bench: Bench) -> None:
    threads = [
        threading.Thread(target=lambda: [bench.driver.command(0.001 * k) for k in range(300)])
        for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    bench.turn(200)
    for thread in threads:
        thread.join()
    assert [pwm for name, pwm in bench.peer.said if name == "applied"] == bench.peer.sent


def test_of_samples_that_wait_the_newest_decides_and_all_are_published_in_order(
    bench: Bench,
) -> None:
    bench.driver.command(0.1)
    places = [0.85, 0.5, 0.01]  # at the end of the rail, but long ago
    for k, place in enumerate(places):
        bench.arrive(age_s=0.05 * (2 - k), sample=Sample(math.pi, 0.0, place, 0.0))
    before = len(bench.peer.sent)
    for _ in places:
        bench.driver.turn()
    shown = [state.cart_m for name, state in bench.peer.said if name == "sample"]
    assert shown[-3:] == places and set(bench.peer.sent[before:]) == {0.1}
    assert bench.driver.health().figures["samples_old"] == 2


def test_an_old_sample_decides_when_none_is_newer(bench: Bench) -> None:
    bench.driver.command(0.1)
    bench.arrive(age_s=0.05, sample=Sample(math.pi, 0.0, 0.85, 0.0))
    bench.driver.turn()
    assert bench.peer.sent[-1] < 0.1


@pytest.mark.parametrize("age_s", [3600.0, -3600.0])
def test_a_clock_that_is_set_makes_no_sample_old(bench: Bench, age_s: float) -> None:
    """The rig samples as ever; the clock by which its samples are stamped jumps."""
    endings: list[Reason] = []
    bench.driver.command(0.02)
    bench.turn()
    assert bench.peer.sent[-1] == 0.02
    bench.now_s += PERIOD_S
    bench.arrive(age_s)
    bench.driver.turn()
    assert bench.peer.sent[-1] == 0.02
    bench.driver.reset(endings.append)
    bench.now_s += PERIOD_S
    bench.arrive(age_s)
    bench.driver.turn()
    assert not endings
    bench.turn(25)
    assert endings == [Reason.RESET_DONE]


def test_a_driver_that_stays_behind_drops_the_oldest_unpublished_samples(bench: Bench) -> None:
    for k in range(MOST_UNPUBLISHED + 3):
        bench.arrive(sample=Sample(math.pi, 0.0, 1e-6 * k, 0.0))
    bench.driver.turn()
    bench.driver.turn()
    assert bench.driver.health().figures["samples_unpublished"] == 2
    assert bench.peer.said[-2][1].cart_m == pytest.approx(3e-6)


def test_samples_from_before_it_served_are_dropped(bench: Bench) -> None:
    ended = threading.Event()
    ended.set()
    bench.arrive(age_s=0.5)
    bench.driver.serve(ended)
    assert not bench.peer.waiting and len(bench.peer.said) == 2


def test_the_stop_is_sent_before_it_is_answered(bench: Bench) -> None:
    bench.driver.command(0.3)
    assert bench.driver.stop() is Reason.STOPPED and bench.peer.sent[-1] == 0.0
    assert bench.driver.command(0.3) is Reason.DROPPED and bench.peer.sent[-1] == 0.0
    assert bench.driver.clear_stop() is Reason.ZERO_FIRST and bench.driver.stopped
    bench.driver.command(0.0)
    assert bench.driver.clear_stop() is Reason.STOP_CLEARED
    assert [latched for name, latched in bench.peer.said if name == "stopped"] == [
        True,
        True,
        False,
    ]


def test_every_reset_is_told_how_it_ended(bench: Bench) -> None:
    endings: list[Reason] = []
    bench.driver.reset(endings.append)
    bench.driver.reset(endings.append)
    bench.turn(25)
    assert endings == [Reason.RESET_DONE] * 2
    bench.driver.reset(endings.append)
    bench.driver.stop()
    bench.driver.reset(endings.append)
    assert endings[2:] == [Reason.RESET_STOPPED] * 2
    assert bench.driver.health().figures["resets"] == 2


def test_two_writers_get_nothing_but_0(bench: Bench) -> None:
    answers = []
    for number in (100, 1, 101, 2):
        bench.driver.hear_writer(number)
        answers.append(bench.driver.command(0.2))
    assert (
        answers == [None, None, Reason.TWO_WRITERS, Reason.TWO_WRITERS]
        and bench.peer.sent[-1] == 0.0
    )
    health = bench.driver.health()
    assert health.level is Level.ERROR and health.sentence == Reason.TWO_WRITERS.sentence


def test_what_fails_in_a_decision_brings_0_and_is_told_and_passes(
    serving: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def drive() -> bool:
        serving.arrive()
        serving.driver.command(0.1)
        return serving.peer.sent[-1] > 0

    until(drive)
    with monkeypatch.context() as broken:
        broken.setattr(module, "decide", lambda *_: 1 / 0)
        until(lambda: serving.peer.said[-1][0] == "failed")
        assert serving.peer.sent[-1] == 0.0
    assert serving.driver.health().sentence == Reason.FAILED.sentence
    until(drive)


def test_even_when_nothing_can_be_published_the_rig_gets_0_and_is_let_go(serving: Bench) -> None:
    def broken(pwm: float) -> None:
        raise RuntimeError("publisher's context is invalid")

    serving.peer.publish_applied = broken
    until(
        lambda: [name for name, _ in serving.peer.said].count("failed") > 2
    )  # its thread goes on
    assert serving.peer.sent[-1] == 0.0
    serving.driver.close()
    assert serving.peer.sent[-LAST_WORDS:] == [0.0] * LAST_WORDS and serving.peer.closed == 2


def test_what_fails_ends_a_reset(bench: Bench) -> None:
    endings: list[Reason] = []
    bench.driver.reset(endings.append)
    bench.driver.fail_safe()
    assert endings == [Reason.RESET_FAILED]


def test_a_network_that_refuses_is_an_error_in_its_own_words(bench: Bench) -> None:
    bench.peer.broken = "cannot send to 10.0.0.1:1: No route to host"
    before = len(bench.peer.said)
    bench.driver.command(0.1)
    assert len(bench.peer.said) == before  # nothing was applied
    health = bench.driver.health()
    assert (health.level, health.sentence) == (Level.ERROR, bench.peer.broken)
    assert health.figures["commands_unsent"] == 1
    bench.peer.broken = ""
    bench.turn()
    assert bench.driver.health().sentence != "cannot send to 10.0.0.1:1: No route to host"


def test_a_missing_connection_is_an_error(bench: Bench) -> None:
    bench.peer.trouble = "nobody listens"
    assert bench.driver.health().sentence == "nobody listens"


@pytest.mark.parametrize("fault", [Reason.NO_LAST_WORD, Reason.LAST_WORD_SILENT])
def test_while_nobody_would_speak_for_it_the_driver_sends_0(bench: Bench, fault: Reason) -> None:
    bench.driver.command(0.02)
    bench.turn()
    assert bench.peer.sent[-1] == 0.02
    bench.driver.health()
    bench.peer.fault = fault
    bench.driver.command(0.02)
    assert bench.peer.sent[-1] == 0.0
    bench.turn()
    assert bench.peer.sent[-1] == 0.0
    assert bench.driver.health().sentence == fault.sentence
    bench.peer.fault = None  # another companion is ready
    bench.driver.command(0.02)
    bench.turn()
    assert bench.peer.sent[-1] == 0.02


def test_closing_says_0_often_and_then_nothing_more(bench: Bench) -> None:
    endings: list[Reason] = []
    bench.driver.command(0.2)
    bench.driver.reset(endings.append)
    bench.driver.close()
    assert bench.peer.sent[-LAST_WORDS:] == [0.0] * LAST_WORDS and endings == [Reason.RESET_ENDED]
    count = len(bench.peer.sent)
    bench.driver.command(0.2)
    bench.turn()
    bench.driver.fail_safe()
    bench.driver.stop()
    bench.driver.close()
    bench.driver.reset(endings.append)
    assert (
        len(bench.peer.sent) == count and bench.peer.closed == 2
    )  # link and last word, once each
    assert endings[1:] == [Reason.RESET_ENDED]


@pytest.mark.parametrize("pwm", [0.0, 0.2])
def test_a_driver_whose_last_words_do_not_go_out_says_so_and_leaves_its_companion(
    bench: Bench, pwm: float
) -> None:
    bench.driver.command(pwm)
    bench.peer.broken = "cannot send to 10.0.0.1:1: Network is unreachable"
    bench.turn()
    left = bench.driver.close()
    assert bench.peer.left_pwm == pwm and bench.peer.closed == 2
    assert left == (pwm > 0) * (
        "expected to send PWM 0 to the rig at the end, found that it did not go out (cannot send "
        "to 10.0.0.1:1: Network is unreachable): the rig may hold PWM 0.2: switch it off"
    )
    assert bench.driver.close() == ""


def test_the_last_word_hears_that_all_is_well_also_while_the_rig_is_silent(bench: Bench) -> None:
    before = bench.peer.wellness
    bench.driver.turn()
    bench.turn()
    assert bench.peer.wellness == before + 2


def test_new_rules_hold_from_the_next_decision_on(bench: Bench, nominal: Rig) -> None:
    bench.driver.command(0.4)
    bench.turn(3)
    bench.driver.change_rules(make_rules(nominal, Limits(0.1)))
    bench.turn()
    assert bench.peer.sent[-1] == 0.1 and bench.driver.health().figures["pwm_limit"] == 0.1

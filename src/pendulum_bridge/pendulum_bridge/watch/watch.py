"""The watch: samples and commands in, an alarm out when the rig has changed."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from pendulum_bridge.watch.alarm import Alarm, changed, slipped, unknown
from pendulum_bridge.watch.baseline import Baseline, learned
from pendulum_bridge.watch.evidence import Evidence, Leader, threshold
from pendulum_bridge.watch.noise import scores, weighed
from pendulum_bridge.watch.reading import Reader, Reading
from pendulum_bridge.watch.resolution import Resolution
from pendulum_bridge.watch.rivals import gained, rivals
from pendulum_bridge.watch.signatures import signatures, worth_of
from pendulum_bridge.watch.slips import Slips
from pendulum_bridge.watch.strangeness import Strangeness
from pendulum_bridge.watch.stream import ANSWERS, History, Stream, still
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

PAST = (
    "gain_drift",
    "encoder_slip",
    "stale_start",
)  # belong to a recording's own time, which is over
CALM = 3.0  # deviations of what the baseline leaves open, added to what is worth an alarm
SETTLE_S = 0.5  # for more windows, an alarm that is not sure waits as many times so long:
LOOKS = (0, 1, 2, 4, 8)
SEPARATE = 3  # windows, at least, that must speak for a change when only strange windows led to it
AGAIN_S = 4.0  # so long after it was raised, an alarm is named and measured once more, from all windows since
RECENT = 32  # windows that are kept for a change to be named from; every other one may be taken
TELLING = (
    6  # windows to which rivals are fitted, at most: those that are furthest off the twin as it is
)


class Phase(Enum):
    """What the watch does now."""

    WAITING = "waiting"  # for samples
    LEARNING = "learning"
    WATCHING = "watching"
    ALARMED = "alarmed"


@dataclass(frozen=True)
class Settings:
    """Say how to watch.

    rate_hz: samples a second. learn_s: seconds of motion to learn from. false_alarm_h: mean hours
    between false alarms, at least, if the rig scatters as it did while it was learned. simulated:
    whether it is a twin, see `Stream`.
    """

    rate_hz: float = 100.0
    learn_s: float = 20.0
    false_alarm_h: float = 1000.0
    simulated: bool = False


class Watch:
    """Watch one rig.

    First it learns what is usual, from seconds in which something moves: what the twin lacks
    already is no alarm. An alarm stays until it is cleared, whatever the rig does; it is named
    once more a little later, and then left as it is.
    """

    def __init__(self, twin: Twin, settings: Settings = Settings()) -> None:
        now = replace(
            twin,
            effects={name: values for name, values in twin.effects.items() if name not in PAST},
        )
        self.settings = settings
        period_s = 1 / settings.rate_hz
        self._bank = signatures(now, period_s)
        self._reader = Reader(now, self._bank, period_s)
        self._hop = self._reader.samples // 2
        self._hop_s = self._hop * period_s
        self._patience = max(1, round(SETTLE_S / self._hop_s))
        joints = tuple(
            k for k, there in enumerate((twin.rig.has_cart, twin.rig.has_pole)) if there
        )
        self.stream = Stream(
            period_s, self._reader.slots + self._hop, 1.0 if settings.simulated else ANSWERS
        )
        self._slips = Slips(joints, self._reader.samples, self._hop)
        tests = 2 * len(self._bank) + 2 * self._hop * len(joints)
        self._threshold = threshold(tests, settings.false_alarm_h, self._hop_s)
        self._resolution = Resolution()
        self._strangeness = Strangeness()
        self._looked = 0
        self._reader.read(
            still(self._reader.least + 1), self._resolution.sensor
        )  # compiles what all windows need
        self.learn()

    def learn(self) -> None:
        """Take the rig as it is now for what is usual: forget the alarm and learn anew."""
        self._learned: list[Reading] = []
        self.baseline: Baseline | None = None
        self._evidence = Evidence(worth_of(self._bank), np.zeros(len(self._bank)), self._threshold)
        self.clear()

    def clear(self) -> None:
        """Forget the alarm and what led to it; what is usual stays."""
        self.alarm: Alarm | None = None
        self._waited = 0  # windows beyond the threshold
        self._named_again = False
        self._windows: deque[tuple[History, float]] = deque(maxlen=RECENT)
        self._slips.clear()
        self._strangeness.clear()
        self._evidence.clear()

    @property
    def phase(self) -> Phase:
        """Return what the watch does now."""
        if self.alarm is not None:
            return Phase.ALARMED
        if self.baseline is not None:
            return Phase.WATCHING
        return Phase.LEARNING if self.stream.samples else Phase.WAITING

    @property
    def learned_s(self) -> float:
        """Return how many seconds of motion it has to learn from, up to now."""
        return len(self._learned) * 2 * self._hop_s

    def command(self, value: float, said_ns: int) -> None:
        """Take a command; see `Stream.command`."""
        self.stream.command(value, said_ns)

    def sample(self, stamp_ns: int, said_ns: int, positions: Sequence[float]) -> Alarm | None:
        """Take a sample (see `Stream.sample`) and return the alarm when this one raises it."""
        begun = self.stream.begun
        if not self.stream.sample(stamp_ns, said_ns, positions):
            return None
        if self.stream.begun != begun:
            self._slips.clear()
        due = self.stream.slot // self._hop * self._hop
        if due <= self._looked:
            return None
        self._looked = due
        history = self.stream.history(due)
        if len(history.command) <= self._reader.least:
            return None
        self._resolution.look(history)
        reading = self._reader.read(history, self._resolution.sensor)
        if reading is None:
            return None
        return (
            self._learn_from(reading)
            if self.baseline is None
            else self._look(history, reading, self.baseline)
        )

    def _learn_from(self, reading: Reading) -> Alarm | None:
        """Keep windows that move and do not overlap; learn when there are enough. Raises no alarm."""
        if not reading.moves or (
            self._learned and reading.slot - self._learned[-1].slot < 2 * self._hop
        ):
            return None
        self._learned.append(reading)
        if self.learned_s >= self.settings.learn_s:
            self.baseline = learned(self._learned, self._bank, self._resolution.sensor)
            self._learned.clear()
            worth = worth_of(self._bank) + CALM * self.baseline.deviations
            self._evidence = Evidence(
                worth, np.array([each.falls for each in self._bank]), self._threshold
            )
        return None

    def _look(self, history: History, reading: Reading, baseline: Baseline) -> Alarm | None:
        """Return the alarm when this window raises one."""
        window = weighed(reading, baseline.noise, baseline.sizes)
        self._windows.append((history, window.misfit / len(window.off)))
        score, information = scores(reading, window)
        self._evidence.add(score, np.diag(information))
        self._strangeness.add(reading, window)
        slip = self._slips.look(reading, window)
        now_ns = reading.end_ns
        if self.alarm is not None:
            self._name_again(self.alarm, baseline, now_ns)
            return None
        if slip is not None and slip.leader.ratio > self._threshold:
            self.alarm = slipped(slip, self._began_ns(1, now_ns), now_ns)
            self._named_again = True
            return self.alarm
        return self._judge(baseline, now_ns)

    def _judge(self, baseline: Baseline, now_ns: int) -> Alarm | None:
        leaders = self._evidence.leaders()
        linear = max(leader.ratio for leader in leaders) >= self._threshold
        if not linear and not self._strangeness.tripped:
            self._waited = 0
            return None
        self._waited += 1
        looks = [1 + look * self._patience for look in LOOKS]
        if self._waited in looks:
            self._decide(leaders, linear, baseline, now_ns, last=self._waited == looks[-1])
        return self.alarm

    def _decide(
        self, leaders: list[Leader], linear: bool, baseline: Baseline, now_ns: int, last: bool
    ) -> None:
        """Raise the alarm if it is sure, or at the last look as it is."""
        alarm, gain = self._named(leaders, baseline, now_ns, now_ns)
        explained = (
            linear
            or float(np.sum(np.minimum(gain, self._threshold / SEPARATE))) >= self._threshold
        )
        if explained and (alarm.sure or last):
            self.alarm = alarm
        elif last:
            self.alarm = unknown(
                *self._strangeness.worst, self._began_ns(self._strangeness.since, now_ns), now_ns
            )

    def _name_again(self, alarm: Alarm, baseline: Baseline, now_ns: int) -> None:
        if self._named_again or (now_ns - alarm.raised_ns) * 1e-9 < AGAIN_S:
            return
        self._named_again = True
        again, _ = self._named(self._evidence.leaders(), baseline, now_ns, alarm.raised_ns)
        if (again.explained, again.confidence) >= (alarm.explained, alarm.confidence):
            self.alarm = replace(again, since_ns=alarm.since_ns)

    def _named(
        self, leaders: list[Leader], baseline: Baseline, now_ns: int, raised_ns: int
    ) -> tuple[Alarm, Floats]:
        """Return the alarm that the windows since the change make, as far as they are kept, and what it explains of each."""
        leader = max(leaders, key=lambda one: one.ratio)
        since = leader.since if leader.ratio >= self._threshold else self._strangeness.since - 1
        whole = max(since - 1, min(since + 1, 3))  # the two oldest may hold the change itself
        separate = list(self._windows)[-1 : -1 - whole : -2]  # they overlap by half
        telling = sorted(separate, key=lambda one: -one[1])[:TELLING]
        windows = [history for history, _ in telling]
        fitted = rivals(self._reader, self._bank, baseline, leaders, windows)
        alarm = changed(self._bank, fitted, self._began_ns(since + 1, now_ns), raised_ns)
        return alarm, gained(self._reader, self._bank, baseline, fitted[0], windows)

    def _began_ns(self, windows: int, now_ns: int) -> int:
        return now_ns - round(windows * self._hop_s * 1e9)

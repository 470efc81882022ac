"""The watch: samples and commands in, an alarm out when the rig has changed."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from pendulum_bridge.watch.alarm import (
    Alarm,
    make_change_alarm,
    make_slip_alarm,
    make_unknown_alarm,
)
from pendulum_bridge.watch.baseline import Baseline, learn_baseline
from pendulum_bridge.watch.candidates import compute_gains, fit_candidates
from pendulum_bridge.watch.evidence import Evidence, Leader, compute_threshold
from pendulum_bridge.watch.noise import compute_scores, weigh
from pendulum_bridge.watch.reading import Reader, Reading
from pendulum_bridge.watch.resolution import Resolution
from pendulum_bridge.watch.signatures import collect_worths, make_signatures
from pendulum_bridge.watch.slips import Slips
from pendulum_bridge.watch.strangeness import Strangeness
from pendulum_bridge.watch.stream import ANSWER_SHARE, History, Stream, make_still_history
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

BASELINE_DEVIATIONS = 3.0  # of the baseline, added to what is worth an alarm
SETTLE_S = 0.5  # unit of the waits of DECISION_LOOKS
DECISION_LOOKS = (0, 1, 2, 4, 8)  # an alarm that is not sure waits so long for more windows
SEPARATE_WINDOWS = 3  # at least, that must speak for a change found by strange windows alone
RENAME_AFTER_S = 4.0  # after an alarm, when it is named again from all windows since
KEPT_WINDOWS = 32  # for a change to be named from, every other one of them
FITTED_WINDOWS = 6  # at most, to which candidates are fitted: those furthest off the twin


class Phase(Enum):
    """What the watch does now."""

    WAITING = "waiting"  # for samples
    LEARNING = "learning"
    WATCHING = "watching"
    ALARMED = "alarmed"


@dataclass(frozen=True)
class Settings:
    """Say how to watch.

    rate_hz: Hz; samples a second.
    learn_s: s; of motion to learn from.
    false_alarm_h: h; mean time between false alarms, at least, while the rig scatters as learned.
    simulated: whether the rig is a twin, see `Stream`.
    """

    rate_hz: float = 100.0
    learn_s: float = 20.0
    false_alarm_h: float = 1000.0
    simulated: bool = False


class Watch:
    """Watch a rig.

    First the watch learns what is usual, from seconds in which something moves: what the twin
    lacks already is no alarm. An alarm stays until it is cleared, whatever the rig does; it is
    named again a little later, and then stays as it is.

    Effects that count a recording's time (`Effect.timed`) are left out of the twin: that time is
    over, and a drift that went on for hours would end in no gain at all.

    twin: the rig as it is believed to be.
    settings: how to watch.
    stream: samples and commands.
    baseline: what is usual; None while the watch learns.
    alarm: what has changed; None without an alarm.
    """

    def __init__(self, twin: Twin, settings: Settings = Settings()) -> None:
        now = twin.drop_timed_effects()
        self.settings = settings
        period_s = 1 / settings.rate_hz
        self._bank = make_signatures(now, period_s)
        self._reader = Reader(now, self._bank, period_s)
        self._hop = self._reader.samples // 2
        self._hop_s = self._hop * period_s
        self._patience = max(1, round(SETTLE_S / self._hop_s))
        joints = tuple(
            k for k, there in enumerate((twin.rig.has_cart, twin.rig.has_pole)) if there
        )
        self.stream = Stream(
            period_s, self._reader.slots + self._hop, 1.0 if settings.simulated else ANSWER_SHARE
        )
        self._slips = Slips(joints, self._reader.samples, self._hop)
        tests = 2 * len(self._bank) + 2 * self._hop * len(joints)
        self._threshold = compute_threshold(tests, settings.false_alarm_h, self._hop_s)
        self._resolution = Resolution()
        self._strangeness = Strangeness()
        self._looked = 0
        still = make_still_history(self._reader.least + 1)
        self._reader.read(still, self._resolution.sensor)  # compiles what all windows need
        self.learn()

    def learn(self) -> None:
        """Take the rig as it is now as usual: forget the alarm and learn anew."""
        self._learned: list[Reading] = []
        self.baseline: Baseline | None = None
        self._evidence = Evidence(
            collect_worths(self._bank), np.zeros(len(self._bank)), self._threshold
        )
        self.clear()

    def clear(self) -> None:
        """Forget the alarm and what led to it; what is usual stays."""
        self.alarm: Alarm | None = None
        self._waited = 0  # windows beyond the threshold
        self._raised_slot, self._named_again = 0, False
        self._windows: deque[tuple[History, float]] = deque(maxlen=KEPT_WINDOWS)
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
        """Keep windows that move and do not overlap; learn once there are enough; return None."""
        if not reading.moves or (
            self._learned and reading.slot - self._learned[-1].slot < 2 * self._hop
        ):
            return None
        self._learned.append(reading)
        if self.learned_s >= self.settings.learn_s:
            self.baseline = learn_baseline(self._learned, self._bank, self._resolution.sensor)
            self._learned.clear()
            worth = collect_worths(self._bank) + BASELINE_DEVIATIONS * self.baseline.deviations
            self._evidence = Evidence(
                worth, np.array([signature.falls for signature in self._bank]), self._threshold
            )
        return None

    def _look(self, history: History, reading: Reading, baseline: Baseline) -> Alarm | None:
        """Return the alarm when this window raises one."""
        window = weigh(reading, baseline.noise, baseline.sizes)
        self._windows.append((history, window.misfit / len(window.off)))
        score, information = compute_scores(reading, window)
        self._evidence.add(score, np.diag(information))
        self._strangeness.add(reading, window)
        slip = self._slips.look(reading, window)
        now_ns = reading.end_ns
        if self.alarm is not None:
            self._name_again(self.alarm, baseline, reading)
            return None
        self._raised_slot = reading.slot
        if slip is not None and slip.leader.ratio > self._threshold:
            self.alarm = make_slip_alarm(slip, self._estimate_begin_ns(1, now_ns), now_ns)
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
        looks = [1 + look * self._patience for look in DECISION_LOOKS]
        if self._waited in looks:
            self._decide(leaders, linear, baseline, now_ns, last=self._waited == looks[-1])
        return self.alarm

    def _decide(
        self, leaders: list[Leader], linear: bool, baseline: Baseline, now_ns: int, last: bool
    ) -> None:
        """Raise the alarm if it is sure, or at the last look as it is."""
        alarm, gain = self._name(leaders, baseline, now_ns, now_ns)
        most = self._threshold / SEPARATE_WINDOWS
        explained = linear or float(np.sum(np.minimum(gain, most))) >= self._threshold
        if explained and (alarm.sure or last):
            self.alarm = alarm
        elif last:
            self.alarm = make_unknown_alarm(
                *self._strangeness.worst,
                self._estimate_begin_ns(self._strangeness.since, now_ns),
                now_ns,
            )

    def _name_again(self, alarm: Alarm, baseline: Baseline, reading: Reading) -> None:
        """Name the alarm anew, once; slots count the time, for stamps may be set back."""
        slots = reading.slot - self._raised_slot
        if self._named_again or slots * self._hop_s / self._hop < RENAME_AFTER_S:
            return
        self._named_again = True
        leaders = self._evidence.leaders()
        again, _ = self._name(leaders, baseline, reading.end_ns, alarm.raised_ns)
        if (again.explained, again.confidence) >= (alarm.explained, alarm.confidence):
            self.alarm = replace(again, since_ns=alarm.since_ns)

    def _name(
        self, leaders: list[Leader], baseline: Baseline, now_ns: int, raised_ns: int
    ) -> tuple[Alarm, Floats]:
        """Return the alarm from the kept windows since the change, and what each gains by it."""
        leader = max(leaders, key=lambda leader: leader.ratio)
        since = leader.since if leader.ratio >= self._threshold else self._strangeness.since - 1
        count = max(since - 1, min(since + 1, 3))  # the two oldest may hold the change itself
        separate = list(self._windows)[-1 : -1 - count : -2]  # they overlap by half
        furthest_off = sorted(separate, key=lambda window: -window[1])[:FITTED_WINDOWS]
        windows = [history for history, _ in furthest_off]
        candidates = fit_candidates(self._reader, self._bank, baseline, leaders, windows)
        alarm = make_change_alarm(
            self._bank, candidates, self._estimate_begin_ns(since + 1, now_ns), raised_ns
        )
        return alarm, compute_gains(self._reader, self._bank, baseline, candidates[0], windows)

    def _estimate_begin_ns(self, windows: int, now_ns: int) -> int:
        """Return the stamp at which the last so many windows began."""
        return now_ns - round(windows * self._hop_s * 1e9)

"""A rig and its driver as two processes of a busy computer, which stops either now and then."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.driver.driver import WAIT_S
from pendulum_bridge.emulator.schedule import LONGEST_BACKLOG_S
from pendulum_bridge.emulator.sensors import Encoders, Sensors
from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.events import begin_reset
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Rules, make_safety
from pendulum_twin.stepper import Stepper
from support.guarded_rigs import PERIOD_S

LONGEST_S = 40.0


@dataclass(frozen=True)
class Standstills:
    """Hold when a process stands still.

    begin_s, end_s: (count,) rising.
    """

    begin_s: np.ndarray
    end_s: np.ndarray

    def wake(self, at_s: float) -> float:
        """Return when a process that is due at a time runs."""
        k = int(np.searchsorted(self.begin_s, at_s, side="right")) - 1
        return max(at_s, float(self.end_s[k])) if k >= 0 else at_s


def draw_standstills(random: np.random.Generator, per_s: float, longest_s: float) -> Standstills:
    """Return standstills at random times: on average so many a second, none longer than that."""
    gaps = random.exponential(1 / per_s, round(2 * LONGEST_S * per_s) + 1)
    lengths = random.uniform(0.005, longest_s, len(gaps))
    begin = np.cumsum(gaps + np.concatenate([[0.0], lengths[:-1]]))
    return Standstills(begin, begin + lengths)


class BusyRig:
    """A rig that samples in time, catches up after a standstill, and holds the last command."""

    def __init__(self, rig: Stepper, still: Standstills, dead_after_s: float) -> None:
        self._rig, self._still, self._dead_after_s = rig, still, dead_after_s
        self._meter, self._dead_m = Sensors(Encoders(), {}, PERIOD_S), 0.0
        self._commands: deque[tuple[float, float]] = deque()  # when it came, PWM
        self._pwm, self._due_s, self._ran_s = 0.0, 0.0, 0.0
        self.samples: deque[tuple[float, RigState]] = deque()  # when it came, what it said

    def send(self, at_s: float, pwm: float) -> None:
        self._commands.append((at_s, pwm))

    def run_until(self, now_s: float) -> None:
        """Sample and step as far as the rig's process gets by now."""
        while (at_s := self._still.wake(max(self._due_s, self._ran_s))) <= now_s:
            if at_s - self._due_s > LONGEST_BACKLOG_S:
                self._due_s = at_s
            moved = self._rig.state
            if self._due_s < self._dead_after_s:
                self._dead_m = moved[0]
            shown = np.array([self._dead_m, *moved[1:]])
            state = RigState(*map(float, self._meter.measure(shown)))
            self.samples.append((at_s, state))
            half_s = self._still.wake(max(at_s, self._due_s + PERIOD_S / 2))
            while self._commands and self._commands[0][0] <= half_s:
                self._pwm = self._commands.popleft()[1]
            self._rig.step(self._pwm)
            self._due_s, self._ran_s = self._due_s + PERIOD_S, half_s


def reset_on_busy_machine(
    rig: Stepper,
    rules: Rules,
    rig_still: Standstills,
    driver_still: Standstills,
    dead_after_s: float = np.inf,
) -> Reason | None:
    """Return how a reset ended, or the fault of an encoder that was claimed; None for neither.

    dead_after_s: s; the cart's encoder then shows the same place for ever.
    """
    busy = BusyRig(rig, rig_still, dead_after_s)
    safety, now_s, begun = make_safety(0.0), 0.0, False
    while now_s < LONGEST_S:
        woken_s = driver_still.wake(now_s)
        busy.run_until(woken_s)
        while not busy.samples and woken_s < now_s + WAIT_S:
            woken_s += 0.0005
            busy.run_until(woken_s)
        now_s, state, ago_s, skipped = driver_still.wake(woken_s), None, 0.0, -1
        while busy.samples and busy.samples[0][0] <= now_s:
            came_s, state = busy.samples.popleft()
            ago_s, skipped = now_s - came_s, skipped + 1
        decision = decide(None, state, now_s, safety, rules, ago_s, max(skipped, 0))
        safety = decision.safety
        if safety.encoders.fault in (Reason.CART_STUCK, Reason.POLE_STUCK):
            return safety.encoders.fault
        if decision.reset_ended is not None:
            return decision.reset_ended
        if state is not None and not begun:
            safety, reason = begin_reset(now_s, safety, rules)
            begun = reason is Reason.RESETTING
        busy.send(now_s, decision.pwm)
        now_s += 0.0003
    return None

"""Many pendulums at once: one compiled call steps them all, with observation, reward and resets inside.

Each pendulum is one of the given twins, drawn anew at every start: that is how a policy meets all
rigs that a recording leaves possible. `NoiseFilter` is not in here: twins do not jump.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.arithmetic import compiled
from pendulum_rl_env.kernel_transport import count_samples, lasting
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task
from pendulum_twin import lanes as live
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.model import Twin

SPREAD_RANGE = (
    0.3,
    np.pi,
    0.5,
    6.0,
)  # how far from hanging at rest in the middle a start may lie: m, rad, m/s, rad/s


class Course(NamedTuple):
    """Hold the running episodes, a row a pendulum; what has just ended stands in last, length and total.

    seen: observations now, (n, 5). last: observation at the end of the step, before a reset.
    reward, end (`End`),
    truncated: of this step. length, total: steps and summed reward of the episode up to and with
    this step. age, sum: of the episode that goes on.
    """

    seen: NDArray[np.float32]
    last: NDArray[np.float32]
    reward: NDArray[np.float64]
    end: NDArray[np.int64]
    truncated: NDArray[np.bool_]
    length: NDArray[np.int64]
    total: NDArray[np.float64]
    age: NDArray[np.int64]
    sum: NDArray[np.float64]


class Rules(NamedTuple):
    """Hold the task for compiled code; bounds of observations; spread: the share of starts that do not hang at rest."""

    limits: tuple[float, float, float]
    penalties: tuple[float, float]
    pwm_limit: float
    steps: int
    bounds: NDArray[np.float32]
    spread: float


@compiled
def _observe(state, bounds, out):
    """Write the observation of a state x, th, v, w; see `task.observation`."""
    x, th, v, w = state
    for k, value in enumerate((x, v, np.sin(th), np.cos(th), w)):
        out[k] = min(max(np.float32(value), -bounds[k]), bounds[k])


@compiled
def _start(kinds, lanes, timing, course, rules, random, i):
    """Begin an episode of pendulum i."""
    kind = int(random.random() * len(kinds.theta))
    away = np.zeros(4)
    if random.random() < rules.spread:
        for k in range(4):
            away[k] = SPREAD_RANGE[k] * (2.0 * random.random() - 1.0)
    live.begin_lane(kinds, lanes, timing, i, kind, away)
    course.age[i] = 0
    course.sum[i] = 0.0
    _observe(lanes.shown[i], rules.bounds, course.seen[i])


@compiled
def start_all(kinds, lanes, timing, course, rules, random):
    """Begin an episode of every pendulum."""
    for i in range(len(course.reward)):
        _start(kinds, lanes, timing, course, rules, random, i)


@compiled
def step_all(code, kinds, lanes, timing, course, rules, random, commands):
    """Hold a command a pendulum for a period; reward, end, and begin anew where an episode is over."""
    for i in range(len(commands)):
        commands[i] = min(max(commands[i], -rules.pwm_limit), rules.pwm_limit)
    live.advance_lanes(code, kinds, lanes, timing, commands)
    for i in range(len(commands)):
        x, th, v, w = lanes.shown[i]
        gain, end = compute_reward_and_end(x, th, v, w, rules.limits, rules.penalties)
        course.age[i] += 1
        course.sum[i] += gain
        course.reward[i], course.end[i] = gain, end
        course.length[i], course.total[i] = course.age[i], course.sum[i]
        course.truncated[i] = (end == 0) & (course.age[i] >= rules.steps)
        _observe(lanes.shown[i], rules.bounds, course.seen[i])
        course.last[i] = course.seen[i]
        if (end != 0) | course.truncated[i]:
            _start(kinds, lanes, timing, course, rules, random, i)


class Fleet:
    """Step count pendulums together.

    twins: what they may be; task: their task; encoders: how finely all are measured; spread: the
    share of episodes that begin anywhere within `SPREAD_RANGE` instead of hanging at rest; seed: of what
    is drawn. course: how they stand, see `Course`; its arrays are written over by the next step.
    """

    def __init__(
        self,
        twins: Sequence[Twin],
        count: int,
        task: Task | None = None,
        encoders: Encoders = EXACT,
        spread: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.task, self.count = task or Task(), count
        self._timing = live.make_timing(self.task.step_s, count_samples(self.task.step_s))
        self._kinds = live.make_kinds([lasting(twin) for twin in twins], self._timing, encoders)
        self._lanes = live.make_lanes(self._kinds, self._timing, count)
        self._code = live.select_lane_code(self._kinds, count)
        limit = min(self.task.pwm_limit, *(twin.rig.pwm_limit or 1.0 for twin in twins))
        self._rules = Rules(
            self.task.limits, self.task.penalties, limit, self.task.steps, self.task.bounds, spread
        )
        self.course = _make_course(count)
        self.reset(seed)

    def reset(self, seed: int | None = None) -> NDArray[np.float32]:
        """Begin every episode anew, with another seed if one is given; return the observations, (count, 5)."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        start_all(self._kinds, self._lanes, self._timing, self.course, self._rules, self._random)
        return self.course.seen

    def step(self, commands: NDArray[np.float64]) -> Course:
        """Hold commands (PWM fractions, (count,)) for a period and return how it stands then."""
        held = np.array(commands, dtype=np.float64).reshape(self.count)
        step_all(
            self._code,
            self._kinds,
            self._lanes,
            self._timing,
            self.course,
            self._rules,
            self._random,
            held,
        )
        return self.course


def _make_course(count: int) -> Course:
    return Course(
        seen=np.zeros((count, 5), dtype=np.float32),
        last=np.zeros((count, 5), dtype=np.float32),
        reward=np.zeros(count),
        end=np.zeros(count, dtype=np.int64),
        truncated=np.zeros(count, dtype=np.bool_),
        length=np.zeros(count, dtype=np.int64),
        total=np.zeros(count),
        age=np.zeros(count, dtype=np.int64),
        sum=np.zeros(count),
    )

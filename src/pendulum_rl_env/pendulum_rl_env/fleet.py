"""Many pendulums at once: one compiled call steps, observes, rewards and resets them all.

Every episode draws one of the given twins, so a policy meets all rigs that a recording leaves
possible. There is no `NoiseFilter` here: twins do not jump.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.arithmetic import compiled
from pendulum_rl_env.kernel_transport import count_samples
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task, check_commands
from pendulum_rl_env.waiting import announce_compiling
from pendulum_twin import lanes as live
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.model import Twin

# How far from hanging at rest in the middle a spread start may lie: m, rad, m/s, rad/s.
SPREAD_RANGE = (0.3, np.pi, 0.5, 6.0)


class Course(NamedTuple):
    """Hold the running episodes, a row a pendulum.

    seen: (n, 5) observations now, after a reset where an episode is over.
    last: (n, 5) observations at the end of the step, before a reset.
    measured: (n, 4) measured states at the end of the step, before a reset.
    reward: (n,) of this step.
    end: (n,) number of the `End` of this step.
    truncated: (n,) whether the episode reached its last step.
    length: (n,) steps of the episode up to and with this step.
    total: (n,) summed reward of the episode up to and with this step.
    age: (n,) steps of the episode that goes on.
    sum: (n,) summed reward of the episode that goes on.
    """

    seen: NDArray[np.float32]
    last: NDArray[np.float32]
    measured: Floats
    reward: Floats
    end: Ints
    truncated: Mask
    length: Ints
    total: Floats
    age: Ints
    sum: Floats


class Rules(NamedTuple):
    """Hold the task for compiled code.

    limits, penalties, steps, bounds: see `Task`.
    pwm_limit: PWM fraction; the smallest limit of task and rigs.
    spread: share of starts that do not hang at rest.
    """

    limits: tuple[float, float, float]
    penalties: tuple[float, float]
    pwm_limit: float
    steps: int
    bounds: NDArray[np.float32]
    spread: float


@compiled
def _observe(state, bounds, out):
    """Write the observation of a state x, th, v, w; see `task.make_observation`."""
    x, th, v, w = state
    for k, value in enumerate((x, v, np.sin(th), np.cos(th), w)):
        out[k] = min(max(np.float32(value), -bounds[k]), bounds[k])


@compiled
def _start(kinds, lanes, timing, course, rules, random, i):
    """Begin an episode of pendulum i: draw its twin and its start."""
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
    """Hold the commands for a period, reward every pendulum, and restart the ended episodes."""
    for i in range(len(commands)):
        commands[i] = min(max(commands[i], -rules.pwm_limit), rules.pwm_limit)
    live.advance_lanes(code, kinds, lanes, timing, commands)
    for i in range(len(commands)):
        x, th, v, w = lanes.shown[i]
        reward, end = compute_reward_and_end(x, th, v, w, rules.limits, rules.penalties)
        course.age[i] += 1
        course.sum[i] += reward
        course.reward[i], course.end[i] = reward, end
        course.length[i], course.total[i] = course.age[i], course.sum[i]
        course.truncated[i] = (end == 0) & (course.age[i] >= rules.steps)
        _observe(lanes.shown[i], rules.bounds, course.seen[i])
        course.last[i] = course.seen[i]
        course.measured[i] = lanes.shown[i]
        if (end != 0) | course.truncated[i]:
            _start(kinds, lanes, timing, course, rules, random, i)


class Fleet:
    """Step several pendulums together; recording effects of the twins are left out.

    twins: what each pendulum may be.
    count: of pendulums.
    task: their task.
    encoders: how finely positions are measured.
    spread: share of episodes that begin anywhere within `SPREAD_RANGE` of hanging at rest.
    seed: of twins and starts.
    course: the running episodes, see `Course`; the next step overwrites its arrays.
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
        kept = [twin.drop_recording_effects() for twin in twins]
        self._kinds = live.make_kinds(kept, self._timing, encoders)
        self._lanes = live.make_lanes(self._kinds, self._timing, count)
        self._code = live.select_lane_code(self._kinds, count)
        limit = min(self.task.pwm_limit, *(twin.rig.pwm_limit or math.inf for twin in twins))
        self._rules = Rules(
            self.task.limits, self.task.penalties, limit, self.task.steps, self.task.bounds, spread
        )
        self.course = _make_course(count)
        with announce_compiling("pendulum_rl_env"):
            self.reset(seed)
            self.step(np.zeros(count))
        self.reset(seed)

    def reset(self, seed: int | None = None) -> NDArray[np.float32]:
        """Begin every episode anew and return the observations (count, 5).

        seed: of twins and starts from now on; None goes on drawing.
        """
        if seed is not None:
            self._random = np.random.default_rng(seed)
        start_all(self._kinds, self._lanes, self._timing, self.course, self._rules, self._random)
        return self.course.seen

    @property
    def measured(self) -> Floats:
        """Return the measured states now, (count, 4), after a reset where an episode is over."""
        return self._lanes.shown

    @property
    def pwm_limit(self) -> float:
        """Return the largest command that is applied: the smallest limit of task and twins."""
        return self._rules.pwm_limit

    def step(self, commands: Floats) -> Course:
        """Hold commands (PWM fractions, (count,)) for a period and return the episodes.

        Raises BadInputError for a command that is no finite number.
        """
        commands = np.array(commands, dtype=np.float64).reshape(self.count)
        check_commands(commands)
        step_all(
            self._code,
            self._kinds,
            self._lanes,
            self._timing,
            self.course,
            self._rules,
            self._random,
            commands,
        )
        return self.course


def _make_course(count: int) -> Course:
    return Course(
        seen=np.zeros((count, 5), dtype=np.float32),
        last=np.zeros((count, 5), dtype=np.float32),
        measured=np.zeros((count, 4)),
        reward=np.zeros(count),
        end=np.zeros(count, dtype=np.int64),
        truncated=np.zeros(count, dtype=np.bool_),
        length=np.zeros(count, dtype=np.int64),
        total=np.zeros(count),
        age=np.zeros(count, dtype=np.int64),
        sum=np.zeros(count),
    )

"""An emulated rig that changes while a controller drives it, in real time over topics.

Emulator, driver, watch, recorder and excitation are the programs that a real rig has, each a
process of its own; the controller runs in this process.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pendulum_bridge.studies.emulated_graph import (
    LONGEST_START_S,
    list_node_arguments,
    make_environment,
    play_plan,
    start_recorder,
    start_rig,
)
from pendulum_bridge.studies.programs import Program, Programs, end_program, wait_for
from pendulum_rl_env.control.design import Controller
from pendulum_rl_env.nodes.topic_transport import TopicTransport
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import HANGING, Task

ALARM = "has changed: "  # what watch_node writes before its sentence
LEARNED = "moves as its twin says"  # in what it writes when it has learned


@dataclass
class Played:
    """Hold an episode over topics.

    controller: name of what drove the rig.
    start_s: s; when it began.
    rewards: reward of each step.
    step_s: s; from command to command.
    """

    controller: str
    start_s: float
    step_s: float
    rewards: list[float] = field(default_factory=list)

    @property
    def reward(self) -> float:
        """Return the sum of the rewards."""
        return sum(self.rewards)


class ChangingRig:
    """Drive, watch, change and record an emulated rig; times are s from the change.

    programs: of the graph.
    emulator, watch: programs of the graph.

    Attributes:
        task: of the controllers.
        episodes: that were played, in order.
    """

    def __init__(self, programs: Programs, emulator: Program, watch: Program) -> None:
        self.episodes: list[Played] = []
        self.task = Task()
        self._programs, self._emulator, self._watch = programs, emulator, watch
        self._transport: TopicTransport | None = None
        self._changed_s: float | None = None
        self._begun_s = time.monotonic()
        # compiles it; within a step there is no time
        compute_reward_and_end(*HANGING, self.task.limits, self.task.penalties)

    @property
    def now_s(self) -> float:
        """Return the time from the change; before the change, from the graph's start."""
        return time.monotonic() - (self._changed_s or self._begun_s)

    @property
    def has_learned(self) -> bool:
        """Return whether the watch has learned what is usual."""
        return LEARNED in self._watch.output

    @property
    def alarm(self) -> str:
        """Return the sentence of the watch's alarm; empty without an alarm."""
        return self._watch.output.partition(ALARM)[2].partition("\n")[0]

    def change(self) -> None:
        """Let the rig become the other rig; the clock begins anew."""
        self._changed_s = time.monotonic()
        for episode in self.episodes:
            episode.start_s -= self._changed_s - self._begun_s
        self._emulator.process.send_signal(signal.SIGUSR1)

    def play(
        self, name: str, controller: Controller, attend: Callable[[int], bool] = lambda k: False
    ) -> Played:
        """Play an episode from hanging at rest, add it to the episodes and return it.

        attend: is told each step's number and says whether the episode is to end after it.
        """
        controller(np.array(HANGING))  # a first call can be slow; the pendulum hangs still
        controller.reset()
        transport = self._connect()
        state = transport.reset().state
        played = Played(name, self.now_s, self.task.step_s)
        self.episodes.append(played)
        for k in range(self.task.steps):
            state = transport.exchange(controller(state)).state
            reward, end = compute_reward_and_end(
                *state.tolist(), self.task.limits, self.task.penalties
            )
            played.rewards.append(reward)
            if end or attend(k):
                break
        return played

    def record(self, out: Path, twin: Path) -> None:
        """Bring the rig to rest, play the standard plan of a minute, and record all of it.

        out: folder of the recording.
        twin: file of the twin that is kept with the recording.
        """
        self._connect().reset()
        self.disconnect()  # a plan does not begin while another node may command the rig
        recorder = start_recorder(self._programs, out, twin, "adaptation")
        try:
            play_plan(self._programs, twin_file=twin, twin="", listeners=2)
        finally:
            end_program(recorder)

    def disconnect(self) -> None:
        """Set PWM to 0 and leave the rig to others; the next episode connects again."""
        if self._transport is not None:
            self._transport.close()
        self._transport = None

    def _connect(self) -> TopicTransport:
        if self._transport is None:
            self._transport = TopicTransport("rig")
        return self._transport


@contextmanager
def open_rig(
    folder: Path, rig: Path, changed: Path | None, believed: Path
) -> Iterator[ChangingRig]:
    """Give a rig that runs and is watched; end all its programs afterwards.

    folder: of the programs' logs.
    rig, changed: twin files of the true rig before and after the change; None without a change.
    believed: file of the twin that the watch knows; the driver takes its limits from `rig`.
    """
    environment = make_environment()
    before = {name: os.environ.get(name) for name in environment}
    os.environ.update(environment)  # this process drives the rig in the same graph
    try:
        with Programs(folder / "logs", environment) as programs:
            yield from _run_rig(programs, rig, changed, believed)
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _run_rig(
    programs: Programs, rig: Path, changed: Path | None, believed: Path
) -> Iterator[ChangingRig]:
    then = () if changed is None else ("--then", changed)
    emulator = start_rig(programs, rig, *then)
    watch = programs.start("watch_node", *list_node_arguments("/watch", twin=believed, rig="/rig"))
    wait_for(watch, "watches", LONGEST_START_S)
    live = ChangingRig(programs, emulator, watch)
    try:
        yield live
    finally:
        live.disconnect()

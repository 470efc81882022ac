"""The latest messages, written by one thread and read by another: frozen records behind a lock."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from threading import Lock

from pendulum_bridge.view.samples import (
    NodeHealth,
    PlanState,
    RecordingState,
    Sample,
    Snapshot,
    Source,
    Word,
)

SAMPLES_KEPT = 256  # enough to match stamps at 1 kHz
NODES_KEPT = 24
FORGOTTEN_AFTER_S = 60.0  # a node that has been silent for so long is no longer listed


class Board:
    """Keep the latest message of every kind; any thread may call every method.

    rig, twin: their namespaces; None for a pendulum that is not listened to.
    """

    def __init__(self, rig: str | None, twin: str | None) -> None:
        given = {"rig": rig, "twin": twin}
        self._sources = {key: Source(name) for key, name in given.items() if name is not None}
        self._nodes: dict[str, NodeHealth] = {}
        self._plan = PlanState()
        self._recordings: tuple[RecordingState, ...] | None = None
        self._lock = Lock()

    def take_sample(self, key: str, sample: Sample) -> None:
        """Keep a sample of `rig` or `twin`; a stamp that does not rise begins a new sequence."""

        def append(source: Source) -> Source:
            before = source.samples[-(SAMPLES_KEPT - 1) :]
            rising = before and before[-1].stamp_ns < sample.stamp_ns
            return replace(source, samples=(*before, sample) if rising else (sample,))

        self._change(key, append)

    def refuse(self, key: str, complaint: str) -> None:
        """Count a message that holds no sample."""
        self._change(
            key, lambda source: replace(source, refused=source.refused + 1, complaint=complaint)
        )

    def take_pwm(self, key: str, word: Word) -> None:
        """Keep a requested command."""
        self._change(key, lambda source: replace(source, pwm=word))

    def take_applied(self, key: str, word: Word) -> None:
        """Keep an applied command."""
        self._change(key, lambda source: replace(source, applied=word))

    def take_stopped(self, key: str, latched: bool | None) -> None:
        """Keep whether the stop is latched; None when no node says so."""
        self._change(key, lambda source: replace(source, stopped=latched))

    def take_health(self, said: NodeHealth) -> None:
        """Keep a node's health; of too many nodes the node heard longest ago is forgotten."""
        with self._lock:
            self._nodes[said.name] = said
            if len(self._nodes) > NODES_KEPT:
                del self._nodes[min(self._nodes.values(), key=lambda node: node.heard_s).name]

    def take_plan(self, **changes: object) -> None:
        """Keep what has changed of the plan: see the fields of `PlanState`."""
        with self._lock:
            self._plan = replace(self._plan, **changes)  # type: ignore[arg-type]

    def take_recordings(self, recordings: tuple[RecordingState, ...]) -> None:
        """Keep the recordings made from the page, the newest first."""
        with self._lock:
            self._recordings = recordings

    def take_snapshot(self, now_s: float) -> Snapshot:
        """Return everything at now_s (s, monotonic)."""
        with self._lock:
            rig, twin = self._sources.get("rig"), self._sources.get("twin")
            nodes = [
                node for node in self._nodes.values() if now_s - node.heard_s < FORGOTTEN_AFTER_S
            ]
            plan, recordings = self._plan, self._recordings
        listed = tuple(sorted(nodes, key=lambda node: node.name))
        return Snapshot(now_s, rig, twin, listed, plan, recordings)

    def _change(self, key: str, change: Callable[[Source], Source]) -> None:
        with self._lock:
            self._sources[key] = change(self._sources[key])

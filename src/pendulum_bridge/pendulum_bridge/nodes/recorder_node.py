"""The recorder: topics as they come over the wire, in a rosbag2 folder that survives a crash."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import String

from pendulum_bridge.driver.parent import Parent
from pendulum_bridge.nodes.raw_topics import RawTopics
from pendulum_bridge.nodes.recorder_settings import RecorderSettings
from pendulum_bridge.recording.command_latency import read_command_latency
from pendulum_bridge.recording.kept_files import read_kept_files
from pendulum_bridge.recording.recover_command import OPTION, run_recover
from pendulum_bridge.recording.session import Session
from pendulum_twin.bags.bag import MEGABYTE, Bag
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health, Level
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.qos import LATCHED
from pendulum_twin.nodes.running import run, spin
from pendulum_twin.nodes.settings import declare_settings
from pendulum_twin.stop_request import StopRequest

DRAIN_S = 0.05
LOOK_S = 0.1  # time between looks for new topics
PROGRESS_S = 5.0
OUTCOME_KEY = "plan_outcome"  # in the custom data of the bag; `sysid` reads it


class RecorderNode(Node):
    """Record from construction until destruction.

    when_ended: called when the recording ends by itself: it lasted long enough, or failed.

    Raises BadInputError for a wrong parameter, or a folder that cannot be written.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("recorder", **options)
        self._session: Session | None = None
        self.when_ended: Callable[[], None] = lambda: None
        try:
            self.settings = settings = declare_settings(self, RecorderSettings)
            self._topics = RawTopics(self, settings.topics)
            self._session = Session(_create_bag(settings), settings.seconds, time.monotonic())
        except BadInputError:
            self.destroy_node()
            raise
        self.create_subscription(String, settings.outcome, self.on_outcome, LATCHED)
        # real time, whatever the simulated time is
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._looked_s = time.monotonic() - LOOK_S
        self._heard: set[str] = set()  # names of the topics that messages came from
        self.create_timer(DRAIN_S, self.on_timer, clock=steady)
        self.create_timer(PROGRESS_S, self.on_progress, clock=steady)
        publish_health(self, lambda: "recorder", self.health)
        self.get_logger().info(f"recording to {settings.out}")

    @property
    def ended(self) -> bool:
        """Whether nothing more is recorded."""
        return self._session is None or self._session.ended

    def on_timer(self) -> None:
        """Record the messages that have come; end when there is a reason to."""
        if self._session is None or self._session.ended:
            return
        self._take(self._session)
        if self._session.ended:
            self.when_ended()

    def _take(self, session: Session) -> None:
        now_s, new = time.monotonic(), []
        try:
            if now_s - self._looked_s >= LOOK_S:
                self._looked_s, new = now_s, self._topics.discover()
            messages = self._topics.drain()
            for name in sorted({message.topic for message in messages} - self._heard):
                self._heard.add(name)
                self.get_logger().info(f"hears {name}")
            session.take(new, messages, self._topics.dropped, now_s)
        except (
            Exception
        ) as error:  # an uncaught error would end the node, and leave the bag without its end
            session.failure = f"the recording ended: {error!r}"

    def on_outcome(self, message: String) -> None:
        """Keep with the recording how the plan stands."""
        if self._session is not None:
            self._session.keep(OUTCOME_KEY, message.data)

    def on_progress(self) -> None:
        """Log the progress."""
        if self._session is not None:
            self.get_logger().info(self._session.summary)

    def health(self) -> Health:
        """Return the recording's health."""
        if self._session is None:
            return Health(Level.OK, "the recording is closed")
        return self._session.health(self._topics.waiting, time.monotonic())

    def finish(self) -> None:
        """Record what is left and close the bag.

        Raises BadInputError with the reason of an early end.
        """
        session, self._session = self._session, None
        if session is None:
            return
        self._take(session)
        session.close()
        self.get_logger().info(f"recorded {session.summary}")

    def destroy_node(self) -> None:
        """Close the bag and destroy the node."""
        with suppress(BadInputError):
            self.finish()
        super().destroy_node()


def _create_bag(settings: RecorderSettings) -> Bag:
    files = {"twin": settings.twin, "plan": settings.plan, "driver": settings.driver}
    kept = read_kept_files({**files, "doctor": settings.doctor})
    custom = {"settings": json.dumps(asdict(settings)), **kept}
    if settings.doctor:
        custom |= read_command_latency(kept["doctor"], settings.doctor)
    if settings.note:
        custom["note"] = settings.note
    return Bag(
        Path(settings.out),
        settings.compression,
        time.time_ns(),
        custom,
        int(settings.least_free_mb * MEGABYTE),
    )


def record(node: RecorderNode, stopped: StopRequest) -> None:
    """Serve the recorder until stopped is set, it has ended, or its parent has.

    The end of the parent counts only with the setting end_with_parent.

    Raises BadInputError if it failed.
    """
    node.when_ended = stopped.set
    parent = Parent() if node.settings.end_with_parent else None
    spin(node, stopped, lambda: parent is not None and parent.ended)
    node.finish()


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`; with --recover, repair a damaged bag instead."""
    arguments = sys.argv if arguments is None else arguments
    if any(word.split("=")[0] == OPTION for word in arguments[1:]):
        return run_recover(arguments[1:])
    description = (
        "Record topics as a rosbag2 folder that stays readable whatever happens. "
        f"`recorder_node {OPTION} FOLDER_OR_FILE` makes a whole bag of what a killed recorder "
        "left."
    )
    return run("recorder_node", description, RecorderSettings, RecorderNode, arguments, record)


if __name__ == "__main__":
    sys.exit(main())

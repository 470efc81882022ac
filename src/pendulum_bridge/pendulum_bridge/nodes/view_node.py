"""A page in the browser: rig and twin side by side, drawn live, with a stop button.

The node listens and sends no command by itself; only a button changes anything. The thread that
spins the node serves ROS, another thread serves the page; the board lies between them. A recorder
and a diagnosis that a button asks for are processes of their own.
"""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from time import monotonic
from typing import Any

from aiohttp import web
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, String

from pendulum_bridge.nodes.view_buttons import Buttons, join_topic
from pendulum_bridge.nodes.view_programs import make_programs
from pendulum_bridge.nodes.view_settings import USUAL_PORT, ViewSettings
from pendulum_bridge.view.board import Board
from pendulum_bridge.view.doorman import Doorman
from pendulum_bridge.view.feed import Feed
from pendulum_bridge.view.recordings import Recordings
from pendulum_bridge.view.same_origin import is_loopback
from pendulum_bridge.view.samples import NodeHealth, Sample, Word
from pendulum_bridge.view.server import Page, make_app
from pendulum_bridge.view.serving import Serving, format_url, open_usual_listener
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health, Level
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.diagnostics import publish_health, read_time_ns
from pendulum_twin.nodes.messages import from_joint_state, from_time
from pendulum_twin.nodes.qos import LATCHED, LATEST, SAMPLES
from pendulum_twin.nodes.running import run
from pendulum_twin.nodes.settings import declare_settings

LOOK_FOR_PUBLISHERS_S = 0.5
OPEN = "--open"


class ViewNode(Node):
    """Serve the page; raise BadInputError when a parameter is wrong or the port is taken."""

    def __init__(self, **options: Any) -> None:
        super().__init__("view", **options)
        try:
            self._settings = declare_settings(self, ViewSettings)
            if self._settings.twin_file:
                load_twin(self._settings.twin_file)  # now, and not after the first recording
            taken = open_usual_listener(self._settings.host, self._settings.port, USUAL_PORT)
        except BadInputError:
            super().destroy_node()
            raise
        self._failure = ""
        names = {
            key: name
            for key, name in (("rig", self._settings.rig), ("twin", self._settings.twin))
            if name
        }
        self.board = Board(names.get("rig"), names.get("twin"))
        for key, name in names.items():
            self._follow(key, name)
        if self._settings.excitation:
            names["excitation"] = self._settings.excitation
            self._follow_plan(self._settings.excitation)
        self._listen(DiagnosticArray, topics.DIAGNOSTICS, SAMPLES, self.on_diagnostics)
        self.buttons = Buttons(self, names, self.board)
        self.url = format_url(taken)
        self._page: Page | None = None
        self._programs = make_programs(self, self._settings)
        self._serving = Serving(taken, self._make_page_app, self._fail)
        publish_health(self, str, self.health)
        self.get_logger().info(f"serves {self.url}")
        if not is_loopback(self._settings.host):
            self.get_logger().warning(
                f"{self._settings.host} is no loopback address: others may stop and reset the rig"
            )

    def on_sample(self, key: str, message: JointState) -> None:
        """Record a sample of rig or twin on the board, or count it as refused."""
        try:
            state = from_joint_state(message)
        except BadInputError as error:
            self.board.refuse(key, str(error))
            return
        stamp_ns = from_time(message.header.stamp)
        cart, pole = (joint in message.name for joint in topics.JOINTS)
        self.board.take_sample(
            key,
            Sample(
                stamp_ns=stamp_ns,
                heard_s=monotonic(),
                age_s=(read_time_ns(self) - stamp_ns) * 1e-9,
                cart_m=float(state[0]) if cart else None,
                pole_rad=float(state[1]) if pole else None,
                cart_m_s=float(state[2]) if cart else None,
                pole_rad_s=float(state[3]) if pole else None,
            ),
        )

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Record the health of the nodes on the board."""
        for status in message.status:
            figures = {pair.key: pair.value for pair in status.values}
            self.board.take_health(
                NodeHealth(status.name, status.level[0], status.message, monotonic(), figures)
            )

    def health(self) -> Health:
        """Return the view's own health."""
        page = self._page
        figures = {
            "browsers": len(page.browsers) if page else 0,
            "connections_turned_away": page.doorman.turned_away if page else 0,
        }
        if self._failure:
            return Health(Level.ERROR, self._failure)
        return Health(Level.OK, f"serves {self.url}", figures)

    def destroy_node(self) -> None:
        """End the page first: its buttons use this node."""
        self._serving.close()
        super().destroy_node()

    def _make_page_app(self) -> tuple[Any, Doorman]:
        fixed = {"rail_half_length_m": self._settings.rail_half_length_m}
        feed = Feed(self.board.take_snapshot, fixed)
        self._page = Page(self._settings.host, feed, self.buttons.press, monotonic, self._complain)
        if not self._settings.recordings:
            return make_app(self._page), self._page.doorman
        recordings = Recordings(
            Path(self._settings.recordings), self._programs, self.board.take_recordings, monotonic
        )
        self.board.take_recordings(())
        self.buttons.recordings, self._page.find_file = recordings, recordings.find_file
        self._page.give_up = self.buttons.give_up
        app = make_app(self._page)

        async def close_recordings(app: web.Application) -> AsyncIterator[None]:
            yield
            await recordings.close()

        app.cleanup_ctx.append(close_recordings)
        return app, self._page.doorman

    def _follow(self, key: str, name: str) -> None:
        def word(take: Callable[[str, Word], None]) -> Callable[[Float64], None]:
            return lambda message: take(key, Word(message.data, monotonic()))

        self._listen(
            JointState,
            join_topic(name, topics.JOINT_STATES),
            SAMPLES,
            lambda message: self.on_sample(key, message),
        )
        self._listen(Float64, join_topic(name, topics.PWM), LATEST, word(self.board.take_pwm))
        self._listen(
            Float64, join_topic(name, topics.APPLIED_PWM), SAMPLES, word(self.board.take_applied)
        )
        stopped = self._listen(
            Bool,
            join_topic(name, topics.STOPPED),
            LATCHED,
            lambda said: self.board.take_stopped(key, said.data),
        )

        def look() -> None:  # a message latched by a node that is gone is void
            if stopped.get_publisher_count() == 0:
                self.board.take_stopped(key, None)

        self.create_timer(
            LOOK_FOR_PUBLISHERS_S, look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def _follow_plan(self, name: str) -> None:
        self._listen(
            Float64,
            join_topic(name, topics.PROGRESS),
            LATCHED,
            lambda message: self.board.take_plan(share=message.data),
        )
        self._listen(
            String,
            join_topic(name, topics.OUTCOME),
            LATCHED,
            lambda message: self.board.take_plan(outcome=message.data),
        )

        def look() -> None:
            self.board.take_plan(offered=self.buttons.is_offered("play"))

        self.create_timer(
            LOOK_FOR_PUBLISHERS_S, look, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )

    def _listen(
        self, kind: type, topic: str, quality: QoSProfile, take: Callable[[Any], None]
    ) -> Any:
        def taken(message: Any) -> None:
            try:
                take(message)
            except Exception as error:  # an uncaught error would end the node
                self._complain(f"{topic}: a message could not be taken: {error!r}")

        return self.create_subscription(kind, topic, taken, quality)

    def _fail(self, sentence: str) -> None:
        self._failure = sentence
        self._complain(sentence)

    def _complain(self, sentence: str) -> None:
        self.get_logger().error(sentence, throttle_duration_sec=1.0)


def make_page_node(is_opened: bool) -> ViewNode:
    """Make the node, print the address of its page on a line of its own, and open the page."""
    node = ViewNode()
    print(node.url, flush=True)
    if is_opened and not webbrowser.open(node.url):
        node.get_logger().warning("no browser was found: open the address above by hand")
    return node


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    arguments = sys.argv if arguments is None else arguments
    is_opened = OPEN in arguments
    if is_opened:
        arguments.remove(OPEN)
    return run(
        "view_node",
        f"A live page of rig and twin on 127.0.0.1; {OPEN} opens it in the browser.",
        ViewSettings,
        lambda: make_page_node(is_opened),
        arguments,
    )


if __name__ == "__main__":
    sys.exit(main())

"""The page's buttons: what each asks of rig, twin, excitation or recorder, and the answer."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from time import monotonic
from typing import Any

from rclpy.node import Node
from std_srvs.srv import Trigger

from pendulum_bridge.nodes.trigger_call import call_trigger
from pendulum_bridge.view.board import Board
from pendulum_bridge.view.live import END_RECORDING, GIVE_UP, RECORD
from pendulum_bridge.view.recordings import Recordings
from pendulum_bridge.view.samples import compute_silence_s
from pendulum_bridge.view.server import ServiceAnswer
from pendulum_twin import topics
from pendulum_twin.emergency_stop import StopAnswer
from pendulum_twin.errors import BadInputError

ANSWER_WITHIN_S = 3.0
RESET_WITHIN_S = 60.0  # a swing-down has a deadline of its own
# A stop is cleared once commands have ended for the driver's timeout: 0.2 s, 2 s for an emulated
# rig. Where its command_timeout_s is longer still, the answer says so, and a later press clears.
QUIET_WITHIN_S = 3.0  # the page itself waits 4 s for an answer
ASK_AGAIN_S = 0.1
SILENT_FOR_LONG_S = 5.0  # a busy computer may stand still for a moment
SERVICES = {
    "stop": ("rig", topics.STOP),
    "clear_stop": ("rig", topics.CLEAR_STOP),
    "reset": ("rig", topics.RESET),
    "reset_twin": ("twin", topics.RESET),
    "play": ("excitation", topics.START),
    "abort": ("excitation", topics.ABORT),
}


class Buttons:
    """Press the page's buttons; the page's event loop calls `press`.

    node: calls the services; another thread spins it.
    names: namespace of `rig`, `twin` and `excitation`, of those that the page shows.
    board: says whether there is anything to record.
    recordings: makes recordings; None before the page is served, and where it records nothing.
    """

    def __init__(self, node: Node, names: Mapping[str, str], board: Board) -> None:
        self._node, self._board = node, board
        self._clients: dict[str, Any] = {
            button: node.create_client(Trigger, join_topic(names[key], service))
            if key in names
            else None
            for button, (key, service) in SERVICES.items()
        }
        self.recordings: Recordings | None = None

    def is_offered(self, button: str) -> bool:
        """Tell whether a node offers the service of a button now."""
        client = self._clients[button]
        return client is not None and client.service_is_ready()

    async def press(self, button: str) -> ServiceAnswer:
        """Do what a button is for and return the answer."""
        if button in (RECORD, END_RECORDING):
            return self._press_recorder(button)
        client = self._clients[button]
        if client is None:
            return ServiceAnswer(False, f"{button}: the view does not listen to this pendulum")
        within_s = RESET_WITHIN_S if client.srv_name.endswith(topics.RESET) else ANSWER_WITHIN_S
        answer = await call_trigger(client, within_s)
        quiet_by = monotonic() + QUIET_WITHIN_S
        while answer.sentence == StopAnswer.ZERO_FIRST.value and monotonic() < quiet_by:
            await asyncio.sleep(ASK_AGAIN_S)  # a sender that has just ended is silent soon
            answer = await call_trigger(client, within_s)
        self._note(client.srv_name, answer)
        return answer

    def give_up(self, name: str) -> ServiceAnswer:
        """Give up the diagnosis of a recording and return the answer."""
        try:
            if self.recordings is None:
                raise BadInputError("the view has no folder for recordings")
            self.recordings.give_up(name)
            answer = ServiceAnswer(True, f"the diagnosis of {name} is given up")
        except BadInputError as error:
            answer = ServiceAnswer(False, str(error))
        self._note(GIVE_UP, answer)
        return answer

    def _press_recorder(self, button: str) -> ServiceAnswer:
        if self.recordings is None:
            return ServiceAnswer(False, f"{button}: the view has no folder for recordings")
        try:
            if button == RECORD:
                self._check_source()
                answer = ServiceAnswer(True, f"recording {self.recordings.begin()}")
            else:
                answer = ServiceAnswer(True, f"{self.recordings.end()} is being closed")
        except BadInputError as error:
            answer = ServiceAnswer(False, str(error))
        self._note(button, answer)
        return answer

    def _check_source(self) -> None:
        """Raise BadInputError when what is to be recorded is silent."""
        now = self._board.take_snapshot(monotonic())
        source = now.rig or now.twin
        silence_s = compute_silence_s(source, now.now_s) if source else None
        if silence_s is None or silence_s > SILENT_FOR_LONG_S:
            name = source.namespace if source else "rig and twin"
            raise BadInputError(f"{name}: expected samples to record, found silence")

    def _note(self, what: str, answer: ServiceAnswer) -> None:
        self._node.get_logger().info(f"{what} was asked for by the page: {answer.sentence}")


def join_topic(namespace: str, name: str) -> str:
    """Return the full name of a topic or service in a namespace."""
    return f"{namespace.rstrip('/')}/{name}"

"""Call a Trigger service from the event loop of another thread."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

from rclpy.client import Client
from std_srvs.srv import Trigger

from pendulum_bridge.view.server import ServiceAnswer


async def call_trigger(client: Client, deadline_s: float) -> ServiceAnswer:
    """Return the answer of a Trigger service, or why it does not answer.

    Another thread spins the client's node.

    deadline_s: s; longest wait for the answer.
    """
    name = client.service_name
    if not client.service_is_ready():
        return ServiceAnswer(False, f"{name}: nobody offers this service: is the node running?")
    loop = asyncio.get_running_loop()
    arrived: asyncio.Future[Trigger.Response] = loop.create_future()

    def hand_over(pending: Any) -> None:
        with suppress(RuntimeError):  # the loop may have ended meanwhile
            loop.call_soon_threadsafe(_settle, arrived, pending.result())

    pending = client.call_async(Trigger.Request())
    pending.add_done_callback(hand_over)
    try:
        response = await asyncio.wait_for(arrived, deadline_s)
    except TimeoutError:
        return ServiceAnswer(
            False, f"{name}: no answer within {deadline_s:g} s; whether it acted is not known"
        )
    finally:
        client.remove_pending_request(pending)
    return ServiceAnswer(bool(response.success), str(response.message))


def _settle(arrived: asyncio.Future[Any], response: Any) -> None:
    if not arrived.done():
        arrived.set_result(response)

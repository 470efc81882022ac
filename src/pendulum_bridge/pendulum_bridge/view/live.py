"""The page's live connection: frames as they are asked for, and a stop that waits for none.

A question is the number of the last frame that the page has (-1: none), or `stop`. The stop's
answer is `{"answer": {"button": "stop", "success": .., "sentence": ..}}`. An open page needs no
new connection to stop the rig.
"""

from __future__ import annotations

import asyncio
import json
from collections import deque
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import Any

from aiohttp import WSCloseCode, WSMsgType, web

from pendulum_bridge.view.feed import Feed

STOP = "stop"
RECORD, END_RECORDING, GIVE_UP = "record", "end_recording", "give_up"
MOST_QUESTIONS = 16  # of frames, kept for a page that asks faster than frames come


async def answer_page(
    socket: web.WebSocketResponse, feed: Feed, stop: Callable[[], Awaitable[dict[str, Any]]]
) -> None:
    """Answer a page's questions until its connection ends.

    socket: the connection.
    feed: the frames.
    stop: stops the rig, and returns the answer.
    """
    questions, new_question = deque[int](maxlen=MOST_QUESTIONS), asyncio.Event()
    sending = asyncio.create_task(_send_frames(socket, feed, questions, new_question))
    stops: set[asyncio.Task[None]] = set()
    try:
        async for question in socket:
            text = question.data if question.type is WSMsgType.TEXT else ""
            if text == STOP:
                stops = {task for task in stops if not task.done()}
                if len(stops) < MOST_QUESTIONS:
                    stops.add(asyncio.create_task(_answer_stop(socket, stop)))
            elif text.removeprefix("-").isdecimal():
                questions.append(int(text))
                new_question.set()
            else:
                await socket.close(
                    code=WSCloseCode.POLICY_VIOLATION, message=b"expected the number of a frame"
                )
                return
    finally:
        sending.cancel()
        await asyncio.gather(sending, *stops, return_exceptions=True)  # a stop is never given up


async def _answer_stop(
    socket: web.WebSocketResponse, stop: Callable[[], Awaitable[dict[str, Any]]]
) -> None:
    answer = await stop()
    with suppress(ConnectionError):
        await socket.send_str(json.dumps({"answer": {"button": STOP, **answer}}))


async def _send_frames(
    socket: web.WebSocketResponse, feed: Feed, questions: deque[int], new_question: asyncio.Event
) -> None:
    sent = -1
    with suppress(ConnectionError):
        while True:
            await new_question.wait()
            after = questions.popleft()
            if not questions:
                new_question.clear()
            await feed.wait_for_newer(max(sent, min(after, feed.number)))
            sent = feed.number
            await socket.send_str(feed.write_text(after))

"""The page's server: the page itself, its live frames over a WebSocket, and its buttons.

A browser requests every frame by the number of the last frame that it has (-1: none), so that
nothing piles up before a slow browser, and a fast browser gets each frame once. Buttons are POST
requests; the answer is `{"success": .., "sentence": ..}`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

from aiohttp import WSCloseCode, web
from aiohttp.typedefs import Handler

from pendulum_bridge.view.doorman import Doorman
from pendulum_bridge.view.feed import Feed, keep_ticking
from pendulum_bridge.view.live import END_RECORDING, GIVE_UP, RECORD, STOP, answer_page
from pendulum_bridge.view.reports import PLACE, make_file_handler
from pendulum_bridge.view.same_origin import find_refusal

BUTTONS = (STOP, "clear_stop", "reset", "reset_twin", "play", "abort", RECORD, END_RECORDING)
KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
MOST_BROWSERS = 32
GIVE_UP_PLACE = f"/recordings/{{name}}/{GIVE_UP}"
LONGEST_QUESTION = 32  # bytes; a question is a number
GOODBYE_S = 1.0  # time for a browser to answer a goodbye
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cache-Control": "no-cache",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


@dataclass(frozen=True)
class ServiceAnswer:
    """Hold the answer of a service: whether it succeeded, and its sentence."""

    success: bool
    sentence: str


@dataclass
class Page:
    """Hold what the server needs, and who is connected.

    host: where the server listens.
    feed: the live frames.
    press: performs a button and returns its answer.
    clock: s; the clock of the feed.
    complain: reports a failure to a person.
    find_file: returns a file of a recording's diagnosis, by the names of both; None for no such.
    give_up: ends the diagnosis of a recording of this name, and returns the answer.
    heartbeat_s: s; a browser that does not answer for so long is disconnected.
    browsers: the open connections.
    pending: buttons whose answer is awaited; each at most once, as a browser opens six requests at
        most and the stop must be among them.
    doorman: decides which connections stay.
    """

    host: str
    feed: Feed
    press: Callable[[str], Awaitable[ServiceAnswer]]
    clock: Callable[[], float]
    complain: Callable[[str], None]
    find_file: Callable[[str, str], Path | None] = lambda name, file: None
    give_up: Callable[[str], ServiceAnswer] = lambda name: ServiceAnswer(
        False, "the page records nothing"
    )
    heartbeat_s: float = 10.0
    browsers: set[web.WebSocketResponse] = field(default_factory=set)
    pending: set[str] = field(default_factory=set)
    doorman: Doorman = field(default_factory=Doorman)


PAGE: web.AppKey[Page] = web.AppKey("page", Page)


def make_app(page: Page) -> web.Application:
    """Return the server of a page; the feed ticks while it runs."""
    app = web.Application(middlewares=[_check_request], client_max_size=1024)
    app[PAGE] = page
    for path, (kind, content) in _read_assets().items():
        app.router.add_get(path, _make_asset_handler(kind, content))
    app.router.add_get("/live", _serve_frames)
    app.router.add_get(PLACE, make_file_handler(page.find_file))
    app.router.add_post("/history", _serve_history)  # a POST says where it comes from
    app.router.add_post(GIVE_UP_PLACE, _give_up)
    for button in BUTTONS:
        app.router.add_post(f"/{button}", _press_button)
    app.on_response_prepare.append(_add_headers)
    app.on_shutdown.append(_say_goodbye)
    app.cleanup_ctx.append(_run_ticks)
    return app


def _read_assets() -> dict[str, tuple[str, bytes]]:
    """Return the files of the page by path: kind and content."""
    assets = {
        f"/{item.name}": (KINDS[item.name.rpartition(".")[2]], item.read_bytes())
        for item in (files("pendulum_bridge.view") / "static").iterdir()
        if item.name.rpartition(".")[2] in KINDS
    }
    return {**assets, "/": assets["/index.html"]}


def _make_asset_handler(kind: str, content: bytes) -> Handler:
    async def answer(request: web.Request) -> web.Response:
        return web.Response(body=content, content_type=kind, charset="utf-8")

    return answer


@web.middleware
async def _check_request(request: web.Request, handler: Handler) -> web.StreamResponse:
    page = request.app[PAGE]
    acts = request.method not in ("GET", "HEAD") or request.path == "/live"
    refused = find_refusal(request.headers, page.host, acts)
    if refused:
        return web.json_response(asdict(ServiceAnswer(False, f"refused. {refused}")), status=403)
    page.doorman.begin(request.transport)
    try:
        return await handler(request)
    except (web.HTTPException, asyncio.CancelledError):
        raise
    except Exception as error:
        page.complain(f"{request.path} failed: {error!r}")
        return web.json_response(
            asdict(ServiceAnswer(False, f"{request.path} failed: {error!r}")), status=500
        )
    finally:
        page.doorman.end(request.transport)


async def _add_headers(request: web.Request, response: web.StreamResponse) -> None:
    for name, value in HEADERS.items():
        response.headers.setdefault(name, value)


async def _press_button(request: web.Request) -> web.Response:
    page, button = request.app[PAGE], request.path[1:]
    if button in page.pending and button != STOP:
        return web.json_response(
            asdict(ServiceAnswer(False, f"{button}: asked for already, its answer is awaited"))
        )
    page.pending.add(button)
    try:
        return web.json_response(await _perform(page, button))
    finally:
        page.pending.discard(button)


async def _give_up(request: web.Request) -> web.Response:
    answer = request.app[PAGE].give_up(request.match_info["name"])
    return web.json_response(asdict(answer))


async def _serve_history(request: web.Request) -> web.Response:
    text = await request.app[PAGE].feed.write_history()
    return web.json_response(text=text)


async def _perform(page: Page, button: str) -> dict[str, Any]:
    return asdict(await page.press(button))


async def _stop(page: Page) -> dict[str, Any]:
    """Press the stop for an open page; its connection has no status to report a failure by."""
    try:
        return await _perform(page, STOP)
    except Exception as error:
        page.complain(f"{STOP} failed: {error!r}")
        return asdict(ServiceAnswer(False, f"{STOP} failed: {error!r}"))


async def _serve_frames(request: web.Request) -> web.StreamResponse:
    page = request.app[PAGE]
    if len(page.browsers) >= MOST_BROWSERS:
        raise web.HTTPServiceUnavailable(
            text=f"expected at most {MOST_BROWSERS} pages at a time: close one"
        )
    socket = web.WebSocketResponse(
        heartbeat=page.heartbeat_s,
        timeout=GOODBYE_S,
        compress=False,
        max_msg_size=LONGEST_QUESTION,
    )
    await socket.prepare(request)
    page.browsers.add(socket)
    try:
        with suppress(ConnectionError):
            await answer_page(socket, page.feed, lambda: _stop(page))
    finally:
        page.browsers.discard(socket)
    return socket


async def _say_goodbye(app: web.Application) -> None:
    goodbyes = (
        socket.close(code=WSCloseCode.GOING_AWAY, message=b"view_node ends")
        for socket in app[PAGE].browsers
    )
    await asyncio.gather(*goodbyes, return_exceptions=True)


async def _run_ticks(app: web.Application) -> AsyncIterator[None]:
    page = app[PAGE]
    task = asyncio.create_task(keep_ticking(page.feed, page.clock, page.complain))
    yield
    task.cancel()
    with suppress(asyncio.CancelledError):
        await task

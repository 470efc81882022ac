"""The files of diagnoses, served apart from the page: a report's scripts must press no button.

The sandbox of the content security policy gives a report an origin of its own, which the page's
buttons refuse, although it comes from the same address.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from aiohttp import web
from aiohttp.typedefs import Handler

PLACE = "/recordings/{name}/{file}"
PAGE_KIND, TEXT_KIND = "text/html; charset=utf-8", "text/plain; charset=utf-8"
POLICY = (
    "sandbox allow-scripts allow-popups; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data:; font-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'"
)


def make_file_handler(find_file: Callable[[str, str], Path | None]) -> Handler:
    """Return the handler of PLACE; `find_file` returns None for what is not offered."""

    async def answer(request: web.Request) -> web.StreamResponse:
        path = find_file(request.match_info["name"], request.match_info["file"])
        if path is None or not path.is_file():
            raise web.HTTPNotFound(text="expected a file of a recording's diagnosis, found none")
        kind = PAGE_KIND if path.suffix == ".html" else TEXT_KIND
        return web.FileResponse(
            path, headers={"Content-Type": kind, "Content-Security-Policy": POLICY}
        )

    return answer

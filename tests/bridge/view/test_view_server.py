"""The page's server on a real loopback socket: who is let in, and what a slow browser gets."""

import asyncio
import json
import os
import resource
import socket
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator
from contextlib import asynccontextmanager, contextmanager
from functools import wraps
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any

import pytest
from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType, WSServerHandshakeError
from support.paths import ROOT

from pendulum_bridge.view import serving
from pendulum_bridge.view.board import Board
from pendulum_bridge.view.doorman import MOST_CONNECTIONS, Doorman
from pendulum_bridge.view.feed import HISTORY_S, KEPT_S, RATE_HZ, Feed
from pendulum_bridge.view.same_origin import find_refusal, is_loopback
from pendulum_bridge.view.server import BUTTONS, Page, ServiceAnswer, make_app
from pendulum_bridge.view.serving import (
    Serving,
    format_url,
    open_listener,
    open_usual_listener,
)
from pendulum_twin.errors import BadInputError

DEADLINE_S = 120.0


class Server:
    """A server in its thread, and what its buttons were asked."""

    def __init__(self, **options: Any) -> None:
        self.pressed: list[str] = []
        self.complaints: list[str] = []
        self.hold: Event | None = None  # until then a reset takes
        taken = open_listener("127.0.0.1", 0)
        self.address = format_url(taken)
        self.socket = taken
        self.serving = Serving(taken, lambda: self.make(options), self.complaints.append)

    def make(self, options: dict[str, Any]) -> Any:
        feed = Feed(Board("/rig", "/twin").take_snapshot)
        self.page = Page(
            "127.0.0.1", feed, self.press, monotonic, self.complaints.append, **options
        )
        return make_app(self.page), self.page.doorman

    async def press(self, button: str) -> ServiceAnswer:
        self.pressed.append(button)
        if button == "clear_stop":
            raise ValueError("broken")
        if self.hold and button == "reset":
            await asyncio.to_thread(self.hold.wait, DEADLINE_S)
        return ServiceAnswer(button == "stop", f"{button} was asked")

    @property
    def origin(self) -> str:
        return self.address.rstrip("/")

    @asynccontextmanager
    async def page_of(self, session: ClientSession) -> AsyncIterator[ClientWebSocketResponse]:
        async with session.ws_connect(
            self.address + "live", origin=self.origin, max_msg_size=0
        ) as live:
            yield live


def served(
    test: Callable[[Server, ClientSession], Coroutine[Any, Any, None]],
) -> Callable[[], None]:
    """Run a test in an event loop of its own, against a server of its own."""

    @wraps(test)
    def run() -> None:
        run_served(test)

    del run.__wrapped__  # type: ignore[attr-defined]  # its arguments are no fixtures
    return run


def run_served(
    test: Callable[[Server, ClientSession], Coroutine[Any, Any, None]], **options: Any
) -> None:
    async def client() -> None:
        async with ClientSession() as session:
            await asyncio.wait_for(test(server, session), 2 * DEADLINE_S)

    server = Server(**options)
    try:
        asyncio.run(client())
    finally:
        server.serving.close()


async def ask(live: ClientWebSocketResponse, after: int) -> dict[str, Any]:
    await live.send_str(str(after))
    return json.loads(await live.receive_str(timeout=DEADLINE_S))


@served
async def test_the_page_and_all_it_needs_come_from_here(
    server: Server, session: ClientSession
) -> None:
    folder = ROOT / "src/pendulum_bridge/pendulum_bridge/view/static"
    for path in ("", *(file.name for file in folder.iterdir())):
        async with session.get(server.address + path) as answer:
            assert answer.status == 200 and answer.headers["X-Content-Type-Options"] == "nosniff"
            text = await answer.text()
            assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
            assert "https://" not in text and text.count("http://") == text.count(
                '"http://www.w3.org/2000/svg"'
            )
    for path in ("../server.py", "%2e%2e/server.py", "server.py"):
        async with session.get(server.address + path) as answer:
            assert answer.status == 404


@served
async def test_ten_minutes_are_kept_for_the_page_alone(
    server: Server, session: ClientSession
) -> None:
    async with server.page_of(session) as live:
        first = await ask(live, -1)
    assert first["kept_s"] == KEPT_S
    async with session.post(
        server.address + "history", headers={"Origin": server.origin}
    ) as answer:
        kept = await answer.json()
    assert kept["columns"] == first["columns"]
    times = [point[0] for point in kept["points"]]
    assert times == sorted(times) and first["time_s"] in times
    for headers in ({}, {"Origin": "http://evil.example"}):
        async with session.post(server.address + "history", headers=headers) as answer:
            assert answer.status == 403
    async with session.get(server.address + "history") as answer:
        assert answer.status == 405


def test_the_usual_port_gives_way_and_a_port_of_choice_does_not() -> None:
    with open_listener("127.0.0.1", 0) as holder:
        port = holder.getsockname()[1]
        with open_usual_listener("127.0.0.1", port, usual=port) as other:
            assert other.getsockname()[1] not in (0, port)
        with pytest.raises(BadInputError, match=f"found {port} in use"):
            open_usual_listener("127.0.0.1", port, usual=port + 1)
    with open_usual_listener("127.0.0.1", port, usual=port) as usual:
        assert usual.getsockname()[1] == port


def test_it_listens_on_loopback_only() -> None:
    server = Server()
    try:
        assert server.socket.getsockname()[0] == "127.0.0.1"
        with socket.socket() as elsewhere:  # another address of this same machine
            assert elsewhere.connect_ex(("127.0.0.2", server.socket.getsockname()[1])) != 0
    finally:
        server.serving.close()


@served
async def test_a_button_answers_with_the_sentence(server: Server, session: ClientSession) -> None:
    for button in BUTTONS:
        async with session.post(
            server.address + button, headers={"Origin": server.origin}
        ) as answer:
            said = await answer.json()
            assert "Access-Control-Allow-Origin" not in answer.headers
        if button == "clear_stop":
            assert (
                answer.status == 500
                and said["sentence"] == "/clear_stop failed: ValueError('broken')"
            )
        else:
            assert said == {"success": button == "stop", "sentence": f"{button} was asked"}
    assert server.pressed == list(BUTTONS)
    async with session.get(server.address + "stop") as answer:
        assert answer.status == 405  # an image of a foreign page would be a GET


@served
async def test_foreign_pages_and_foreign_names_press_nothing(
    server: Server, session: ClientSession
) -> None:
    port = server.address.rsplit(":", 1)[1].rstrip("/")
    rebound = f"evil.example:{port}"
    for headers, what in (
        ({}, "Origin"),
        ({"Origin": "null"}, "Origin"),
        ({"Origin": "http://evil.example"}, "Origin"),
        ({"Origin": f"http://127.0.0.1:{int(port) + 1}"}, "Origin"),
        ({"Host": rebound, "Origin": f"http://{rebound}"}, "Host"),
    ):
        async with session.post(server.address + "stop", headers=headers) as answer:
            assert answer.status == 403 and (await answer.json())["sentence"].startswith(
                f"refused. {what}: expected"
            )
        with pytest.raises(WSServerHandshakeError, match="403"):
            await session.ws_connect(server.address + "live", headers=headers)
    async with session.get(server.address, headers={"Host": rebound}) as answer:
        assert answer.status == 403
    async with session.options(
        server.address + "stop", headers={"Origin": "http://evil.example"}
    ) as answer:
        assert answer.status == 403 and "Access-Control-Allow-Origin" not in answer.headers
    assert server.pressed == []


def test_a_report_is_served_apart_from_the_page(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("<h1>named</h1>")
    (tmp_path / "twin.yaml").write_text("name: <b>rig</b>")
    offered = {("monday", file): tmp_path / file for file in ("report.html", "twin.yaml", "gone")}

    async def test(server: Server, session: ClientSession) -> None:
        place = server.address + "recordings/monday/"
        for file, kind in (("report.html", "text/html"), ("twin.yaml", "text/plain")):
            async with session.get(place + file) as answer:
                assert answer.status == 200 and answer.content_type == kind
                assert await answer.text() == (tmp_path / file).read_text()
                policy = answer.headers["Content-Security-Policy"]
                assert policy.startswith("sandbox allow-scripts") and "same-origin" not in policy
                assert answer.headers["X-Content-Type-Options"] == "nosniff"
        for path in ("verdict.json", "gone", "../monday/report.html/x", "%2e%2e%2fserver.py"):
            async with session.get(place + path) as answer:
                assert answer.status == 404
        headers = {"Host": "evil.example"}
        async with session.get(place + "report.html", headers=headers) as answer:
            assert answer.status == 403

    run_served(test, find_file=lambda name, file: offered.get((name, file)))


def test_a_diagnosis_is_given_up_by_the_page_alone() -> None:
    asked: list[str] = []

    def give_up(name: str) -> ServiceAnswer:
        asked.append(name)
        return ServiceAnswer(True, f"the diagnosis of {name} is given up")

    async def test(server: Server, session: ClientSession) -> None:
        place = server.address + "recordings/monday/give_up"
        async with session.post(place) as answer:
            assert answer.status == 403
        assert asked == []
        async with session.post(place, headers={"Origin": server.origin}) as answer:
            assert (await answer.json())["sentence"] == "the diagnosis of monday is given up"

    run_served(test, give_up=give_up)
    assert asked == ["monday"]


@served
async def test_stop_gets_through_while_a_reset_is_under_way(
    server: Server, session: ClientSession
) -> None:
    server.hold = Event()
    headers = {"Origin": server.origin}
    pressing = asyncio.create_task(
        session.post(server.address + "reset", headers=headers).__aenter__()
    )
    while "reset" not in server.pressed:
        await asyncio.sleep(0.01)
    async with session.post(server.address + "reset", headers=headers) as answer:
        assert (await answer.json())[
            "sentence"
        ] == "reset: asked for already, its answer is awaited"
    async with session.post(server.address + "stop", headers=headers) as answer:
        assert (await answer.json())["success"] is True
    assert server.pressed == ["reset", "stop"]
    server.hold.set()
    assert (await (await pressing).json())["sentence"] == "reset was asked"


@served
async def test_frames_come_about_thirty_times_a_second_each_once(
    server: Server, session: ClientSession
) -> None:
    async with server.page_of(session) as live:
        numbers, times = [], []
        after = -1
        for _ in range(20):
            got = await ask(live, after)
            assert got["number"] > after
            after = got["number"]
            numbers.append(after)
            times.append(got["time_s"])
        assert (numbers[-1] - numbers[0]) / (times[-1] - times[0]) < 1.2 * RATE_HZ


@served
async def test_a_browser_that_paused_gets_the_newest_at_once(
    server: Server, session: ClientSession
) -> None:
    async with server.page_of(session) as slow, server.page_of(session) as fast:
        first = await ask(slow, -1)
        number = first["number"]
        while number < first["number"] + 15:
            number = (await ask(fast, number))["number"]
        late = await ask(slow, first["number"])
        assert late["number"] >= number  # one answer, and it is the newest
        assert len(late["points"]) == late["number"] - first["number"]


@served
async def test_a_browser_that_asks_without_reading_holds_up_nobody(
    server: Server, session: ClientSession
) -> None:
    async with ClientSession() as other, server.page_of(session) as good:
        greedy = await other.ws_connect(
            server.address + "live", origin=server.origin, max_msg_size=0
        )
        for _ in range(3000):
            await greedy.send_str("-1")
        before = (await ask(good, -1))["number"]
        number = before
        while number < before + 15:
            number = (await ask(good, number))["number"]
        async with session.post(
            server.address + "stop", headers={"Origin": server.origin}
        ) as answer:
            assert (await answer.json())["success"] is True
        got = [
            json.loads(await greedy.receive_str(timeout=DEADLINE_S))["number"] for _ in range(5)
        ]
        assert got == sorted(set(got)), "a frame came twice"
        assert max(got) <= number + round(HISTORY_S * RATE_HZ)


@pytest.mark.parametrize("question", ["", "x", "1.5", "--1", "9" * 40])
def test_what_is_no_number_of_a_frame_ends_the_connection(question: str) -> None:
    @served
    async def host_header(server: Server, session: ClientSession) -> None:
        async with server.page_of(session) as live:
            await live.send_str(question)
            message = await live.receive(timeout=DEADLINE_S)
            assert message.type in (WSMsgType.CLOSE, WSMsgType.CLOSED)
        assert server.complaints == []

    host_header()


@served
async def test_the_server_says_goodbye_and_ends(server: Server, session: ClientSession) -> None:
    async with server.page_of(session) as live:
        await ask(live, -1)
        await asyncio.to_thread(server.serving.close)
        message = await live.receive(timeout=DEADLINE_S)
        assert message.type is WSMsgType.CLOSE and message.data == 1001
    assert server.socket.fileno() == -1 and server.complaints == []


def test_a_server_that_fails_says_so_and_lets_go_of_its_port() -> None:
    def broken() -> Any:
        raise ValueError("broken")

    complaints: list[str] = []
    taken = open_listener("127.0.0.1", 0)
    Serving(taken, broken, complaints.append).close()
    assert (
        complaints == ["the page is no longer served: ValueError('broken')"]
        and taken.fileno() == -1
    )


async def press_stop(server: Server, session: ClientSession) -> dict[str, Any]:
    async with session.post(server.address + "stop", headers={"Origin": server.origin}) as answer:
        return await answer.json()


@contextmanager
def crowd(server: Server, count: int, said: bytes) -> Iterator[list[socket.socket]]:
    """Open connections that say a part of a request and nothing more."""
    opened: list[socket.socket] = []
    try:
        for _ in range(count):
            opened.append(socket.create_connection(server.socket.getsockname()))
            if said:
                opened[-1].send(said)
        yield opened
    finally:
        for connection in opened:
            connection.close()


@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\nHost: 127"], ids=["silent", "half"])
def test_half_open_connections_leave_the_page_and_its_stop(said: bytes) -> None:
    """As many as a process may have files open; a page that is open already stays open."""
    files = resource.getrlimit(resource.RLIMIT_NOFILE)
    # the crowd's own ends are files of this process, too, and the server's would be too many
    now = len(os.listdir("/proc/self/fd"))
    resource.setrlimit(resource.RLIMIT_NOFILE, (now + 1100 + 200, files[1]))

    @served
    async def test(server: Server, session: ClientSession) -> None:
        async with server.page_of(session) as live:
            before = (await ask(live, -1))["number"]
            with crowd(server, 1100, said):
                async with ClientSession() as newcomer:
                    async with newcomer.get(server.address) as answer:
                        assert answer.status == 200
                    assert (await press_stop(server, newcomer))["success"] is True
                assert (await ask(live, before))["number"] > before
        assert server.page.doorman.turned_away >= 1100 - MOST_CONNECTIONS
        assert server.complaints == []

    try:
        test()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, files)


@served
async def test_an_open_page_stops_the_rig_without_a_new_connection(
    server: Server, session: ClientSession
) -> None:
    server.hold = Event()
    async with server.page_of(session) as live:
        number = (await ask(live, -1))["number"]
        await live.send_str(str(number + 10**6))  # it awaits a frame, and does not wait for it
        await live.send_str("stop")
        said = {}
        while "answer" not in said:
            said = json.loads(await live.receive_str(timeout=DEADLINE_S))
        assert said["answer"] == {"button": "stop", "success": True, "sentence": "stop was asked"}
    assert server.pressed == ["stop"]


def test_a_connection_without_a_whole_request_is_closed(monkeypatch) -> None:
    monkeypatch.setattr(serving, "IDLE_S", 0.2)
    server = Server()
    try:
        with crowd(server, 3, b"POST /stop HTTP/1.1\r\nHost: ") as connections:
            for connection in connections:
                connection.settimeout(DEADLINE_S)
                assert connection.recv(1) == b""
    finally:
        server.serving.close()


class FakeTransport(asyncio.Transport):
    """A connection for the doorman."""

    closed = False

    def is_closing(self) -> bool:
        return self.closed

    def abort(self) -> None:
        self.closed = True


def test_a_busy_connection_stays_and_the_greediest_client_loses() -> None:
    doorman = Doorman(4)
    doors = {name: FakeTransport() for name in ("a1", "b1", "b2", "b3", "a2", "c1")}
    for name in ("a1", "b1", "b2", "b3"):
        doorman.admit(doors[name], name[0])
    doorman.begin(doors["b1"])
    doorman.admit(doors["a2"], "a")  # b holds most, and its oldest answers a request
    assert [name for name, door in doors.items() if door.closed] == ["b2"]
    for name in ("a1", "a2", "b3"):
        doorman.begin(doors[name])
    doorman.admit(doors["c1"], "c")  # all others are busy
    assert doors["c1"].closed and doorman.turned_away == 2
    doors["a1"].abort()
    doors["c1"] = FakeTransport()
    doorman.admit(doors["c1"], "c")
    assert not doors["c1"].closed


def test_a_browser_that_hangs_is_let_go() -> None:
    server = Server(heartbeat_s=0.2)
    try:
        host, port = server.socket.getsockname()
        with socket.create_connection((host, port), timeout=DEADLINE_S) as hanging:
            request = (
                f"GET /live HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: "
                f"{server.origin}\r\nUpgrade: websocket\r\n"
            )
            keys = (
                "Connection: Upgrade\r\nSec-WebSocket-Key: "
                "AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
            )
            hanging.sendall((request + keys).encode())
            received = b""
            while piece := hanging.recv(4096):  # ends when the server closes; it answers no ping
                received += piece
        assert received.startswith(b"HTTP/1.1 101")
    finally:
        server.serving.close()


@pytest.mark.parametrize(
    ("host", "host_header", "passes"),
    [
        ("127.0.0.1", "127.0.0.1:80", True),
        ("127.0.0.1", "localhost:9999", True),  # a forwarded port
        ("127.0.0.1", "[::1]:80", True),
        ("127.0.0.1", "evil.example", False),
        ("127.0.0.1", "192.168.1.7:80", False),
        ("127.0.0.1", "", False),
        ("127.0.0.1", "[::1", False),
        ("127.0.0.1", "127.0.0.1.evil.example", False),
        ("0.0.0.0", "192.168.1.7:80", True),
        ("0.0.0.0", "evil.example:80", False),
        ("lab-pc", "lab-pc:80", True),
    ],
)
def test_hosts(host: str, host_header: str, passes: bool) -> None:
    headers = {"Host": host_header, "Origin": f"http://{host_header}"}
    assert (find_refusal(headers, host, acts=True) is None) is passes


@pytest.mark.parametrize(
    ("host", "loopback"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False)],
)
def test_what_counts_as_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) is loopback


def test_an_address_that_cannot_be_had_is_told_in_a_sentence() -> None:
    with open_listener("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(
            BadInputError, match=f"port: expected a free port of 127.0.0.1, found {port} in use"
        ):
            open_listener("127.0.0.1", port)
    with pytest.raises(
        BadInputError, match=r"host: expected an address of this machine, found '192\.0\.2\.1'"
    ):
        open_listener("192.0.2.1", 0)
    with pytest.raises(
        BadInputError, match="host: expected an address of this machine, found 'no such host'"
    ):
        open_listener("no such host", 0)

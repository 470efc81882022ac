"""The page in a headless browser: two twins play rig and twin, a small node plays the driver."""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import Any
from unittest import mock

import pytest

rclpy = pytest.importorskip("rclpy")
pytest.importorskip("playwright.sync_api")
from playwright.sync_api import Browser, Locator, Page, expect  # noqa: E402
from rclpy.node import Node  # noqa: E402
from std_msgs.msg import Bool, Float64, String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.chromium import (  # noqa: E402
    DEADLINE_MS,
    NEEDS_CHROMIUM,
    launch_chromium,
    list_violations,
)
from support.page_programs import let_diagnoses_end, make_fake_programs  # noqa: E402
from support.paths import CONFIG  # noqa: E402
from support.ros_graph import Graph, graph  # noqa: E402

from pendulum_bridge.nodes.view_node import ViewNode  # noqa: E402
from pendulum_bridge.view import server as view  # noqa: E402
from pendulum_bridge.view.board import Board  # noqa: E402
from pendulum_bridge.view.feed import HISTORY_S, Feed  # noqa: E402
from pendulum_bridge.view.frame import COLUMNS  # noqa: E402
from pendulum_bridge.view.server import ServiceAnswer, make_app  # noqa: E402
from pendulum_bridge.view.serving import Serving, open_listener  # noqa: E402
from pendulum_twin.health import Health, Level  # noqa: E402
from pendulum_twin.nodes.diagnostics import publish_health  # noqa: E402
from pendulum_twin.nodes.qos import LATCHED  # noqa: E402
from pendulum_twin.nodes.twin_node import TwinNode  # noqa: E402

pytestmark = NEEDS_CHROMIUM
expect.set_options(timeout=DEADLINE_MS)


class Driver(Node):
    """Drive both pendulums with a sine, and offer the stop that the buttons call."""

    def __init__(self, **options: Any) -> None:
        super().__init__("driver", **options)
        self.calls: list[str] = []
        self._latch = self.create_publisher(Bool, "stopped", LATCHED)
        self.latch(False)
        for name, latched in (("stop", True), ("clear_stop", False)):
            self.create_service(
                Trigger,
                name,
                lambda _, answer, name=name, to=latched: self.on_call(name, to, answer),
            )
        self._commands = [
            self.create_publisher(Float64, f"/{name}/pwm", 1) for name in ("rig", "twin")
        ]
        self.create_timer(0.02, self.on_timer)
        publish_health(
            self,
            lambda: "rig",
            lambda: Health(Level.WARN, "drives <b>two</b> at once", {"calls": len(self.calls)}),
        )

    def on_call(self, name: str, latched: bool, answer: Trigger.Response) -> Trigger.Response:
        self.calls.append(name)
        self.latch(latched)
        answer.success, answer.message = (
            True,
            "PWM is 0 until the stop is cleared" if latched else "the stop is cleared",
        )
        return answer

    def latch(self, latched: bool) -> None:
        self.latched = latched
        self._latch.publish(Bool(data=latched))

    def on_timer(self) -> None:
        for publisher, size in zip(self._commands, (0.3, 0.25), strict=True):
            publisher.publish(
                Float64(data=0.0 if self.latched else size * math.cos(7.0 * monotonic()))
            )


class Player(Node):
    """Offer to play a plan, and play it for ever."""

    def __init__(self, **options: Any) -> None:
        super().__init__("player", **options)
        self.outcome = self.create_publisher(String, "outcome", LATCHED)
        self.progress = self.create_publisher(Float64, "progress", LATCHED)
        for name, outcome in (("start", "under way"), ("abort", "not played to its end: aborted")):
            self.create_service(
                Trigger, name, lambda _, answer, outcome=outcome: self.on_call(outcome, answer)
            )

    def on_call(self, outcome: str, answer: Trigger.Response) -> Trigger.Response:
        self.progress.publish(Float64(data=0.25))
        self.outcome.publish(String(data=outcome))
        answer.success, answer.message = True, f"now {outcome}"
        return answer


class World:
    """The graph, served by a thread: the test's own thread belongs to the browser.

    folder: gets recordings, which quick programs make in place of recorder and `sysid`.
    """

    def __init__(self, ros: Graph, folder: Path) -> None:
        self.folder = folder
        self.rig = ros.add(TwinNode, "/rig", twin=str(CONFIG / "inteco.yaml"))
        self.twin = ros.add(TwinNode, "/twin", twin=str(CONFIG / "inteco.yaml"))
        for service in list(self.rig.services):  # the driver's stop is meant, and nobody else's
            if service.srv_name.endswith("stop"):
                self.rig.destroy_service(service)
        self.driver = ros.add(Driver, "/rig")
        programs = "pendulum_bridge.nodes.view_node.make_programs"
        with mock.patch(programs, lambda node, settings: make_fake_programs()):
            self.view = ros.add(ViewNode, port=0, recordings=str(folder))
        self.player = ros.add(Player, "/excitation")
        self._ended = Event()
        self._thread = Thread(target=self._serve, args=[ros])
        self._thread.start()

    def _serve(self, ros: Graph) -> None:
        while not self._ended.is_set():
            ros.spin()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    with graph() as ros:
        made = World(ros, tmp_path_factory.mktemp("recordings"))
        try:
            yield made
        finally:
            made.close()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with launch_chromium() as launched:
        yield launched


# Chromium says so of a connection that ends with its page, before the server has answered.
CLOSED_EARLY = "closed before the connection is established"


@contextmanager
def opened(browser: Browser, url: str, complaints: list[str]) -> Iterator[Page]:
    """Open the page; complaints: what its console says, and every request to anybody else."""
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "request",
        lambda request: None if request.url.startswith(url) else complaints.append(request.url),
    )
    page.goto(url)
    yield page
    page.close()


@pytest.fixture
def page(browser: Browser, world: World) -> Iterator[Page]:
    """Give the page as it is once samples come; it must not complain."""
    complaints: list[str] = []
    world.driver.latch(False)
    world.driver.calls.clear()
    with opened(browser, world.view.url, complaints) as made:
        for name in ("rig", "twin"):
            expect(made.locator(f"#{name}")).to_have_attribute("data-state", "fresh")
        yield made
        assert [each for each in complaints if CLOSED_EARLY not in each] == []


def number(page: Page, name: str) -> float | None:
    text = page.locator(f"[data-value='{name}']").inner_text().replace("−", "-")
    return None if text == "–" else float(text)


def until(page: Page, done: Callable[[], Any], what: str) -> Any:
    end = monotonic() + DEADLINE_MS / 1000
    while not (result := done()):
        assert monotonic() < end, f"waited for {what}"
        page.wait_for_timeout(50)
    return result


def pixels(canvas: Locator) -> str:
    return canvas.evaluate("canvas => canvas.toDataURL()")


def banner(page: Page, key: str) -> Locator:
    return page.locator(f"[data-banner='{key}']")


def test_both_move_in_numbers_and_pictures(world: World, page: Page) -> None:
    canvases = page.locator("canvas:visible").all()
    assert len(canvases) == 7  # two stages, five plots
    names = (
        "rig.cart_m",
        "rig.pole_rad",
        "twin.cart_m",
        "twin_pole_rad",
        "rig_applied_pwm",
        "mismatch_cart_m",
    )
    before = [number(page, name) for name in names], [pixels(canvas) for canvas in canvases]
    for k, name in enumerate(names):
        until(
            page,
            lambda k=k, name=name: number(page, name) not in (None, before[0][k]),
            f"{name} to move",
        )
    for k, canvas in enumerate(canvases):
        until(
            page,
            lambda k=k, canvas=canvas: pixels(canvas) != before[1][k],
            f"canvas {k} to be drawn anew",
        )
    expect(canvases[0]).to_have_attribute(
        "aria-label", re.compile(r"^rig: cart at [−+]?\d\.\d+ m, pole at")
    )
    mismatch_m = lambda: (number(page, "rig.cart_m") or 0.0) - (number(page, "twin.cart_m") or 0.0)  # noqa: E731
    until(
        page,
        lambda: abs(mismatch_m() - (number(page, "mismatch_cart_m") or 1e9) / 1000) < 0.02,
        "the mismatch to fit",
    )


def test_a_command_is_called_no_pwm_for_it_may_be_in_volts(page: Page) -> None:
    expect(page.locator("#plots")).to_contain_text("Command applied")
    expect(page.locator("#rig")).to_contain_text("Command asked for")
    shown = [page.locator(place).inner_text() for place in ("#plots", "#rig", "#twin")]
    assert "PWM" not in "".join(shown)


def test_health_is_shown_as_text(page: Page) -> None:
    row = page.locator("[data-node='/rig/driver']")
    expect(row).to_have_attribute("data-level", "warn")
    expect(row.locator(".sentence")).to_have_text(
        "drives <b>two</b> at once"
    )  # no markup of others is let in
    row.locator("summary").click()
    expect(row.locator("td").first).to_have_text("calls")


def test_stop_by_button_and_by_key_reaches_the_service(world: World, page: Page) -> None:
    latch, answer = page.locator("#latch"), page.locator("#answer")
    expect(latch).to_have_text("stop not latched")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(answer).to_have_text("Stop: PWM is 0 until the stop is cleared")
    expect(latch).to_have_text("stop latched")
    expect(banner(page, "stop")).to_contain_text("The stop is latched")
    page.locator("[data-button=clear_stop]").click()
    expect(answer).to_have_text("Clear stop: the stop is cleared")
    expect(banner(page, "stop")).to_have_count(0)
    expect(page.locator("[data-button=clear_stop]")).to_be_focused()
    page.keyboard.press("Space")  # must not press the button that has the focus
    expect(answer).to_have_text("Stop: PWM is 0 until the stop is cleared")
    calls = world.driver.calls
    until(page, lambda: len(calls) >= 5, "the stop by Space, over both ways")
    page.keyboard.press("Escape")
    until(page, lambda: len(calls) >= 7, "the stop by Escape")
    # each stop goes over the open connection and by a request of its own
    assert calls == ["stop", "stop", "clear_stop", "stop", "stop", "stop", "stop"]
    page.locator("[data-button=reset_twin]").click()
    expect(answer).to_have_attribute("data-success", "true")
    expect(answer).to_contain_text("Reset twin: ")


def test_clear_stop_is_greyed_when_nothing_is_latched(world: World, page: Page) -> None:
    clear = page.locator("[data-button=clear_stop]")
    expect(clear).to_have_attribute("aria-disabled", "true")
    clear.click(force=True)
    world.driver.latch(True)
    expect(clear).not_to_have_attribute("aria-disabled", "true")
    assert world.driver.calls == []  # the click on the grey button asked for nothing
    clear.click()
    expect(page.locator("#answer")).to_have_text("Clear stop: the stop is cleared")
    expect(clear).to_have_attribute("aria-disabled", "true")


def test_a_plan_is_played_and_aborted(page: Page) -> None:
    play, abort = (page.locator(f"[data-button={name}]") for name in ("play", "abort"))
    expect(play).to_be_visible()
    expect(abort).to_have_attribute("aria-disabled", "true")
    play.click()
    expect(page.locator("#plan")).to_have_text("Plan under way, 25 % played")
    expect(play).to_have_attribute("aria-disabled", "true")
    abort.click()
    expect(page.locator("#answer")).to_have_text("Abort plan: now not played to its end: aborted")
    expect(page.locator("#plan")).to_have_text("Plan not played to its end: aborted")
    expect(play).not_to_have_attribute("aria-disabled", "true")


def test_a_recording_ends_in_a_verdict_beside_the_plots(world: World, page: Page) -> None:
    record, end = (page.locator(f"[data-button={name}]") for name in ("record", "end_recording"))
    row = page.locator("[data-recording]").first
    expect(record).to_be_visible()
    expect(end).to_have_attribute("aria-disabled", "true")
    record.click()
    expect(page.locator("#answer")).to_have_text(re.compile("^Record: recording 20"))
    expect(row).to_have_attribute("data-stage", "recording")
    expect(record).to_have_attribute("aria-disabled", "true")
    expect(row.locator(".level")).to_contain_text("recording, ")
    end.click()
    expect(row).to_have_attribute("data-stage", "diagnosing")
    expect(row.locator("progress")).to_have_js_property("value", 0.4)
    expect(row.locator(".sentence")).to_contain_text("growing the set")
    # a diagnosis that does not end holds up neither the stop nor the frames nor a recording
    seen = number(page, "rig.cart_m")
    until(page, lambda: number(page, "rig.cart_m") != seen, "the rig to move on")
    page.keyboard.press("Escape")
    expect(page.locator("#latch")).to_have_text("stop latched")
    expect(record).not_to_have_attribute("aria-disabled", "true")
    assert list_violations(page) == []
    let_diagnoses_end(world.folder)
    expect(row.locator(".level")).to_have_text("verdict: named")
    expect(row.locator(".sentence")).to_have_text("Dry friction <b>holds</b>, nice 10.")
    expect(page.locator("#recordings [role=status]")).to_contain_text("verdict: named. Dry fric")
    assert list_violations(page) == []
    calls = len(world.driver.calls)
    with page.context.expect_page() as opening:
        row.get_by_role("link", name="Report").click()
    report = opening.value
    expect(report.locator("h1")).to_have_text("The report")
    # its script asked for a stop; its origin is not the page's
    expect(report).to_have_title(re.compile("Failed to fetch|refused. Origin"))
    assert report.evaluate("window.opener") is None and len(world.driver.calls) == calls
    report.close()


def test_a_running_diagnosis_is_given_up_and_the_recording_stays(world: World, page: Page) -> None:
    (world.folder / "go").unlink(missing_ok=True)
    record, end = (page.locator(f"[data-button={name}]") for name in ("record", "end_recording"))
    row = page.locator("[data-recording]").first
    record.click()
    expect(row).to_have_attribute("data-stage", "recording")
    give_up = row.locator("button")
    expect(give_up).to_be_hidden()  # there is nothing to give up yet
    end.click()
    expect(row.locator("progress")).to_have_js_property("value", 0.4)
    name = row.get_attribute("data-recording")
    expect(give_up).to_have_accessible_name(f"Give up the diagnosis of {name}")
    assert list_violations(page) == []
    give_up.focus()
    page.keyboard.press("Enter")
    expect(page.locator("#answer")).to_have_text(f"Give up: the diagnosis of {name} is given up")
    expect(row.locator(".level")).to_have_text("given up")
    expect(row.locator(".sentence")).to_contain_text("was given up; the recording stays in")
    expect(page.locator("#recordings [role=status]")).to_contain_text("the recording stays in")
    expect(give_up).to_be_hidden()
    expect(row).to_be_focused()  # and not the top of the page
    assert (world.folder / name / "recording" / "bag").read_text() == "whole"
    assert not (world.folder / name / "diagnosis").exists()
    assert list_violations(page) == []


def test_plots_freeze_scroll_back_and_go_on(page: Page) -> None:
    plot = page.locator(".plot canvas").first
    page.get_by_role("button", name="Freeze").click()
    expect(page.locator("#when")).to_contain_text("frozen")
    until(page, lambda: page.evaluate("document.body.dataset.time") == "frozen", "the freeze")
    seen = number(page, "rig.cart_m")
    until(page, lambda: number(page, "rig.cart_m") != seen, "the rig's card to stay live")
    back = page.locator("#back")
    shown = page.locator(".plot output").first
    frozen = pixels(plot), shown.inner_text()
    back.fill("3")
    until(page, lambda: pixels(plot) != frozen[0], "another stretch")
    expect(page.locator("#when")).to_have_text(re.compile(r"frozen, [\d.]+ s ago"))
    assert float(page.locator("#when").inner_text().split()[1]) >= 3.0
    page.get_by_role("button", name="Live").click()
    expect(page.locator("#when")).to_have_text("live")
    expect(back).to_have_value("0")
    until(page, lambda: shown.inner_text() != frozen[1], "the plots to go on")


def test_what_is_shown_is_downloaded(page: Page) -> None:
    page.get_by_role("button", name="Freeze").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Download CSV").click()
    lines = download.value.path().read_text().splitlines()
    assert download.value.suggested_filename == "rig_and_twin.csv"
    assert lines[0] == ",".join(COLUMNS)
    times = [float(line.split(",")[0]) for line in lines[1:]]
    assert len(times) > 10 and times == sorted(times) and times[-1] - times[0] <= HISTORY_S
    assert all(line.count(",") == len(COLUMNS) - 1 for line in lines)
    page.get_by_role("button", name="Live").click()


def test_an_earlier_time_is_fetched_when_a_person_looks_back(world: World, page: Page) -> None:
    feed = world.view._page.feed
    oldest = feed._kept[0][0]
    page.get_by_role("button", name="Freeze").click()
    page.locator("#back").fill("600")  # before anything was recorded: nothing is drawn there
    expect(page.locator("#when")).to_contain_text("frozen")
    page.locator("#back").fill("0")
    with page.expect_download() as download:
        page.get_by_role("button", name="Download CSV").click()
    first = float(download.value.path().read_text().splitlines()[1].split(",")[0])
    assert first >= oldest
    page.get_by_role("button", name="Live").click()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everybody_can_use_it(page: Page, scheme: Any) -> None:
    page.emulate_media(color_scheme=scheme)
    until(page, lambda: not list_violations(page), "a page without violations")


def test_a_source_that_dies_is_told(world: World, page: Page) -> None:
    expect(banner(page, "twin")).to_have_count(0)
    for timer in world.twin.timers:
        timer.cancel()
    try:
        expect(banner(page, "twin")).to_have_text("/twin is silent: its last sample is shown.")
        expect(page.locator("#twin")).to_have_attribute("data-state", "stale")
        expect(page.locator("#rig")).to_have_attribute("data-state", "fresh")
        assert number(page, "mismatch_cart_m") is None
    finally:
        for timer in world.twin.timers:
            timer.reset()
    expect(banner(page, "twin")).to_have_count(0)


def serving(port: int) -> Serving:
    """Serve a page that nobody feeds."""

    async def press(button: str) -> ServiceAnswer:
        return ServiceAnswer(True, f"{button} was asked")

    def make() -> Any:
        feed = Feed(Board("/rig", "/twin").take_snapshot)
        page = view.Page("127.0.0.1", feed, press, monotonic, print)
        return make_app(page), page.doorman

    return Serving(open_listener("127.0.0.1", port), make, print)


def test_a_lost_connection_is_told_and_found_again(browser: Browser) -> None:
    with open_listener("127.0.0.1", 0) as free:
        port = free.getsockname()[1]
    server = serving(port)
    try:
        with opened(browser, f"http://127.0.0.1:{port}/", []) as page:
            expect(banner(page, "rig")).to_have_text(
                "No sample of /rig yet: waiting for /rig/joint_states."
            )
            server.close()
            expect(banner(page, "link")).to_contain_text("Connection lost")
            expect(page.locator("#latch")).to_have_text("stop state unknown")
            expect(banner(page, "rig")).to_have_count(0)
            page.keyboard.press("Escape")
            expect(banner(page, "unstopped")).to_contain_text(
                "Stop did not get through: view_node cannot be reached."
            )
            server = serving(port)
            expect(page.locator("#link")).to_have_text("connected")
            expect(banner(page, "link")).to_have_count(0)
            page.keyboard.press("Escape")
            expect(page.locator("#answer")).to_have_text("Stop: stop was asked")
            expect(banner(page, "unstopped")).to_have_count(0)
    finally:
        server.close()


def test_it_fits_a_phone_in_the_dark(page: Page) -> None:
    page.emulate_media(color_scheme="dark")
    page.set_viewport_size({"width": 360, "height": 740})
    until(
        page,
        lambda: page.evaluate("document.documentElement.scrollWidth") <= 360,
        "no scrolling sideways",
    )
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert max(map(int, re.findall(r"\d+", dark)[:3])) < 40
    stop = page.get_by_role("button", name="Stop", exact=True)
    page.mouse.wheel(0, 1500)
    until(page, lambda: page.evaluate("scrollY") > 500, "scrolling")
    expect(stop).to_be_in_viewport(ratio=1)
    until(
        page,
        lambda: page.locator("#rig canvas").evaluate("c => c.width") <= 360,
        "a smaller canvas",
    )

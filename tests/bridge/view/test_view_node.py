"""The view as a node: what it hears, what its buttons call, how it starts and ends."""

import asyncio
import json
import math
import re
import signal
from concurrent.futures import ThreadPoolExecutor
from html import unescape
from pathlib import Path
from time import monotonic
from typing import Any
from urllib.request import Request, urlopen

import pytest

rclpy = pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Bool, Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.excitation_bench import LONG, written  # noqa: E402
from support.excitation_bench import make as make_excitation  # noqa: E402
from support.paths import CONFIG  # noqa: E402
from support.ros_graph import DEADLINE_S, Graph  # noqa: E402

from pendulum_bridge.excitation.run import Stage  # noqa: E402
from pendulum_bridge.nodes.driver_settings import EMULATED_TIMEOUT_S  # noqa: E402
from pendulum_bridge.nodes.trigger_call import call_trigger  # noqa: E402
from pendulum_bridge.nodes.view_node import ViewNode  # noqa: E402
from pendulum_bridge.view.samples import Source, is_fresh  # noqa: E402
from pendulum_bridge.view.samples import Stage as Recorded  # noqa: E402
from pendulum_bridge.view.server import ServiceAnswer  # noqa: E402
from pendulum_twin.emergency_stop import StopAnswer  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.nodes.messages import to_time  # noqa: E402
from pendulum_twin.nodes.qos import LATCHED, LATEST, SAMPLES  # noqa: E402
from pendulum_twin.nodes.twin_node import TwinNode  # noqa: E402

MODULE = "pendulum_bridge.nodes.view_node"
YIELDS_S = 600.0  # s; for a program that yields to all others of a busy computer


@pytest.fixture
def view(ros: Graph) -> ViewNode:
    return ros.add(ViewNode, port=0)


def heard(view: ViewNode, key: str = "rig") -> Source:
    source = getattr(view.board.take_snapshot(0.0), key)
    assert source is not None
    return source


def state(cart: float, stamp_ns: int = 10**9, **changed: Any) -> JointState:
    message = JointState(name=["cart", "pole"], position=[cart, 3.0], velocity=[0.1, -0.2])
    message.header.stamp = to_time(stamp_ns)
    for name, value in changed.items():
        setattr(message, name, value)
    return message


def pressed(ros: Graph, call: Any) -> ServiceAnswer:
    """Await a call in its own thread, as the page's server does; the nodes are served here."""
    pool = ThreadPoolExecutor(1)
    future = pool.submit(asyncio.run, call)
    ros.until(future.done, "the answer")
    pool.shutdown()
    return future.result()


@pytest.mark.parametrize("key", ["rig", "twin"])
def test_it_hears_each_by_its_names(ros: Graph, view: ViewNode, key: str) -> None:
    user = ros.user(namespace=f"/{key}")
    topics = {
        "joint_states": state(0.25),
        "pwm": Float64(data=0.4),
        "applied_pwm": Float64(data=0.3),
    }
    publishers = {
        name: user.create_publisher(type(message), name, SAMPLES)
        for name, message in topics.items()
    }
    ros.until(lambda: all(p.get_subscription_count() for p in publishers.values()), "the view")
    for name, message in topics.items():
        publishers[name].publish(message)
    ros.until(
        lambda: heard(view, key).samples and heard(view, key).pwm and heard(view, key).applied,
        "all three",
    )
    source = heard(view, key)
    last = source.samples[-1]
    assert (last.cart_m, last.pole_rad, last.cart_m_s, last.pole_rad_s) == (0.25, 3.0, 0.1, -0.2)
    assert last.stamp_ns == 10**9 and last.age_s > 1e6  # a stamp of 1970
    assert source.pwm is not None and source.applied is not None
    assert (source.pwm.value, source.applied.value) == (0.4, 0.3)
    other = heard(view, "twin" if key == "rig" else "rig")
    assert (other.samples, other.pwm, other.applied) == ((), None, None)


@pytest.mark.parametrize(
    "changed",
    [
        {"position": [math.nan, 3.0]},
        {"velocity": [0.0, math.inf]},
        {"position": [0.1]},
        {"name": []},
        {"name": ["elbow", "wrist"]},
    ],
)
def test_what_is_no_sample_is_refused_with_its_sentence(
    view: ViewNode, changed: dict[str, Any]
) -> None:
    view.on_sample("rig", state(0.1, **changed))
    source = heard(view)
    assert (
        source.refused == 1
        and source.samples == ()
        and source.complaint.startswith("joint_states: expected")
    )


def test_a_pole_alone_has_no_cart(view: ViewNode) -> None:
    view.on_sample("twin", JointState(name=["pole"], position=[3.0], velocity=[0.5]))
    last = heard(view, "twin").samples[-1]
    assert (last.cart_m, last.cart_m_s, last.pole_rad, last.pole_rad_s) == (None, None, 3.0, 0.5)


def test_the_latch_is_known_from_before_and_unknown_once_nobody_says(
    ros: Graph, view: ViewNode
) -> None:
    rig = ros.user("rig_node", "/rig")
    rig.create_publisher(Bool, "stopped", LATCHED).publish(Bool(data=True))
    ros.until(lambda: heard(view).stopped is True, "the latch")
    ros.remove(rig)
    ros.until(lambda: heard(view).stopped is None, "the end of the latch")


def test_health_of_all_nodes_and_of_itself_is_heard(ros: Graph, view: ViewNode) -> None:
    user = ros.user()
    publisher = user.create_publisher(DiagnosticArray, "/diagnostics", SAMPLES)
    status = DiagnosticStatus(
        level=b"\x02",
        name="/rig/driver",
        message="silent",
        values=[KeyValue(key="sent", value="7")],
    )
    names = lambda: {node.name: node for node in view.board.take_snapshot(0.0).nodes}  # noqa: E731
    ros.until(
        lambda: publisher.publish(DiagnosticArray(status=[status])) or len(names()) == 2,
        "health of both",
    )
    driver, own = names()["/rig/driver"], names()["/view"]
    assert (driver.level, driver.sentence, driver.figures) == (2, "silent", {"sent": "7"})
    assert own.level == 0 and own.sentence == f"serves {view.url}"


@pytest.mark.parametrize(
    ("button", "service"),
    [
        ("stop", "/rig/stop"),
        ("clear_stop", "/rig/clear_stop"),
        ("reset", "/rig/reset"),
        ("reset_twin", "/twin/reset"),
    ],
)
def test_a_button_calls_its_service_and_says_what_it_said(
    ros: Graph, view: ViewNode, button: str, service: str
) -> None:
    user, calls = ros.user(), []

    def on_call(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        calls.append(service)
        response.success, response.message = False, f"no {service} today"
        return response

    user.create_service(Trigger, service, on_call)
    ros.until(lambda: view.buttons.is_offered(button), service)
    assert pressed(ros, view.buttons.press(button)) == ServiceAnswer(False, f"no {service} today")
    assert calls == [service]


def test_a_button_without_a_service_says_so(ros: Graph, view: ViewNode) -> None:
    answer = pressed(ros, view.buttons.press("stop"))
    assert answer == ServiceAnswer(
        False, "/rig/stop: nobody offers this service: is the node running?"
    )


def test_a_service_that_never_answers_is_given_up(ros: Graph) -> None:
    rig, user = ros.user("rig"), ros.user()
    rig.create_service(Trigger, "stop", lambda request, response: response)
    client = user.create_client(Trigger, "stop")
    ros.until(client.service_is_ready, "the service")
    ros.executor.remove_node(rig)  # it is there, and does nothing
    answer = pressed(ros, call_trigger(client, 0.3))
    assert not answer.success and answer.sentence.startswith("/stop: no answer within 0.3 s")
    assert client._pending_requests == {}


def test_without_a_twin_there_is_only_the_rig(ros: Graph) -> None:
    view = ros.add(ViewNode, port=0, twin="", rig="/lab/rig")
    assert view.board.take_snapshot(0.0).twin is None and heard(view).namespace == "/lab/rig"
    assert pressed(ros, view.buttons.press("reset_twin")).success is False


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"rig": "/a", "twin": "/a"},
            "twin: expected another namespace than that of the rig, found '/a' for both",
        ),
        ({"rig": "no namespace"}, "rig: expected a namespace such as /rig, found 'no namespace'"),
        ({"port": 70000}, "port: expected a whole number from 0 to 65535, found 70000"),
        ({"port": "http"}, "port: expected a whole number from 0 to 65535, found 'http'"),
        ({"twin_file": "none.yaml"}, "none.yaml"),
        ({"host": ""}, "host: expected an address of this machine, found none"),
        ({"host": "192.0.2.1"}, "host: expected an address of this machine, found '192.0.2.1'"),
        (
            {"rail_half_length_m": math.nan},
            "rail_half_length_m: expected a number from 0.01 to 100, found nan",
        ),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(
    ros: Graph, values: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        ros.add(ViewNode, **{"port": 0, **values})


@pytest.mark.parametrize("timeout_s", [0.2, EMULATED_TIMEOUT_S])
def test_clear_stop_needs_no_other_node_once_the_sender_has_ended(
    ros: Graph, view: ViewNode, timeout_s: float
) -> None:
    twin = str(CONFIG / "inteco.yaml")
    ros.add(TwinNode, "/rig", twin=twin, command_timeout_s=timeout_s)
    sender = ros.user(namespace="/rig").create_publisher(Float64, "pwm", LATEST)
    ros.until(sender.get_subscription_count, "the rig")
    ros.until(lambda: view.buttons.is_offered("clear_stop"), "the service")
    sender.publish(Float64(data=0.3))
    assert pressed(ros, view.buttons.press("stop")).success
    sender.publish(Float64(data=0.3))  # the last command was not 0: silence has to do
    answer = pressed(ros, view.buttons.press("clear_stop"))
    assert answer == ServiceAnswer(True, StopAnswer.CLEARED.value)


def test_a_plan_is_played_and_aborted_with_the_guards_of_its_node(
    ros: Graph, view: ViewNode, tmp_path: Path
) -> None:
    plan = lambda: view.board.take_snapshot(0.0).plan  # noqa: E731
    assert pressed(ros, view.buttons.press("play")).success is False  # nobody offers it
    for space in ("/rig", "/twin"):
        ros.add(TwinNode, space, twin=str(CONFIG / "inteco.yaml"))
    values = {"start": "service", "exit_when_done": False, "namespace": "/excitation"}
    node = make_excitation(ros, written(tmp_path, *LONG), **values)
    ros.until(lambda: plan().offered, "the plan to be offered")
    assert pressed(ros, view.buttons.press("play")) == ServiceAnswer(
        True, "the plan begins when all is ready"
    )
    ros.until(lambda: node._run.stage is Stage.PLAYING and plan().share > 0.0, "the plan")
    assert plan().outcome == "under way"
    assert pressed(ros, view.buttons.press("abort")) == ServiceAnswer(True, "the plan is aborted")
    ros.until(lambda: plan().outcome.startswith("not played to its end: "), "the outcome")
    assert pressed(ros, view.buttons.press("abort")).sentence.startswith("nothing to abort")


def fetch(view: ViewNode, path: str) -> tuple[str, Any]:
    with urlopen(view.url + path, timeout=DEADLINE_S) as answer:
        return answer.read().decode(), answer.headers


def post(ros: Graph, view: ViewNode, button: str) -> ServiceAnswer:
    """Press a button of the page as a browser does; the nodes are served here."""
    headers = {"Origin": view.url.rstrip("/")}
    request = Request(view.url + button, method="POST", headers=headers)
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(urlopen, request, timeout=DEADLINE_S)
        ros.until(future.done, "the answer")
    with future.result() as answer:
        return ServiceAnswer(**json.load(answer))


class Rig(Node):
    """Publish samples 10 ms apart by their stamps, and the command, while there are any left."""

    def __init__(self, **options: Any) -> None:
        super().__init__("rig", **options)
        self.samples = self.create_publisher(JointState, "joint_states", SAMPLES)
        self.applied = self.create_publisher(Float64, "applied_pwm", SAMPLES)
        self.begin(0)
        self.create_timer(0.01, self.on_timer)

    def begin(self, count: int) -> None:
        self._stamp_ns, self.left = self.get_clock().now().nanoseconds, count

    def on_timer(self) -> None:
        if self.left:
            self.left -= 1
            self._stamp_ns += 10**7
            self.applied.publish(Float64(data=0.1))
            self.samples.publish(state(0.001 * (self.left % 7), self._stamp_ns))


def test_a_recording_of_the_rig_ends_in_a_verdict_that_the_page_serves(
    ros: Graph, tmp_path: Path
) -> None:
    """Recorder and `sysid` are real; 2.3 s are too short, and a verdict says so."""
    twin_file, folder = str(CONFIG / "inteco.yaml"), tmp_path / "my recordings"
    view = ros.add(
        ViewNode, port=0, twin="", rig="/lab/rig", recordings=str(folder), twin_file=twin_file
    )
    newest = lambda: (view.board.take_snapshot(0.0).recordings or [None])[0]  # noqa: E731
    health = lambda: {  # noqa: E731
        node.name: node.figures for node in view.board.take_snapshot(monotonic()).nodes
    }.get("/view/recorder", {})
    ros.until(lambda: view.buttons.recordings, "the page")
    silent = post(ros, view, "record")
    assert silent == ServiceAnswer(False, "/lab/rig: expected samples to record, found silence")
    rig = ros.add(Rig, "/lab/rig")
    rig.begin(10**9)
    ros.until(lambda: is_fresh(heard(view), monotonic()), "samples")
    assert post(ros, view, "record").success
    rig.begin(0)
    ros.until(lambda: newest().stage is Recorded.RECORDING, "the recorder")
    publishers = rig.samples, rig.applied
    ros.until(lambda: all(p.get_subscription_count() == 2 for p in publishers), "it to listen")
    rig.begin(230)
    ros.until(lambda: int(health().get("messages", 0)) >= 460, "the recorder's own word")
    assert post(ros, view, "end_recording").success
    ros.until(lambda: newest().stage.over, "the verdict, of a program that yields", YIELDS_S)
    assert (newest().stage, newest().outcome) == (Recorded.DONE, "unusable"), newest()
    place = f"recordings/{newest().name}"
    report, headers = fetch(view, f"{place}/report.html")
    assert newest().sentence in unescape(report)
    assert headers["Content-Security-Policy"].startswith("sandbox ")
    verdict = json.loads(fetch(view, f"{place}/verdict.json")[0])
    assert verdict["sentence"] == newest().sentence


def test_without_a_folder_nothing_is_recorded(ros: Graph) -> None:
    view = ros.add(ViewNode, port=0, recordings="")
    assert view.board.take_snapshot(0.0).recordings is None
    answer = post(ros, view, "record")
    assert answer == ServiceAnswer(False, "record: the view has no folder for recordings")


def test_its_address_stands_on_a_line_of_its_own_and_is_opened(
    ros: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said_to = tmp_path / "opened"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {said_to}\n')
    browser.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    program = ros.start(MODULE, "--open", "--ros-args", "-p", "port:=0")
    line = program.stdout.readline()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\n", line)
    ros.until(lambda: said_to.exists() and said_to.read_text() == line.strip(), "the browser")
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=DEADLINE_S)
    assert program.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly_and_frees_the_port(ros: Graph, number: signal.Signals) -> None:
    program = ros.start(MODULE, "--ros-args", "-p", "port:=0")
    said = program.stderr.readline()
    address = re.search(r"serves (http://127\.0\.0\.1:\d+/)", said)
    assert address, said
    with urlopen(address[1], timeout=DEADLINE_S) as page:
        assert page.status == 200
    if number is signal.SIGTERM:  # a second one finds the port taken
        port = address[1].rsplit(":", 1)[1].rstrip("/")
        second = ros.start(MODULE, "--ros-args", "-p", f"port:={port}")
        _, why = second.communicate(timeout=DEADLINE_S)
        assert second.returncode == 1
        assert (
            f"view_node: port: expected a free port of 127.0.0.1, found {port} in use" in why
            and "Traceback" not in why
        )
    program.send_signal(number)
    _, said = program.communicate(timeout=DEADLINE_S)
    assert program.returncode == 0 and said == ""
    with pytest.raises(OSError, match="refused"):
        urlopen(address[1], timeout=DEADLINE_S)


def test_the_page_tells_what_the_node_hears(ros: Graph, view: ViewNode) -> None:
    view.on_sample("rig", state(0.125))
    feed = ros.until(lambda: view._page, "the page").feed
    before = feed.number
    ros.until(lambda: feed.number > before + 1, "a frame")
    latest = json.loads(feed.write_text(before))
    assert latest["rig"]["cart_m"] == 0.125 and latest["rail_half_length_m"] == 0.9

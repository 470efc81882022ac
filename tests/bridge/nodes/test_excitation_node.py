"""The excitation over real topics: which command answers which sample, and how it ends."""

import math
import re
import signal
import subprocess
from functools import partial

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from std_msgs.msg import Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.excitation_bench import (  # noqa: E402
    BUSY_S,
    LONG,
    NUMBERED,
    PUSHED,
    TWIN,
    Bench,
    StepRig,
    make,
    written,
)
from support.ros_graph import DEADLINE_S, Graph  # noqa: E402

from pendulum_bridge.excitation.playback import SAMPLES_A_LOOK, SAMPLES_QUEUED  # noqa: E402
from pendulum_bridge.excitation.run import Stage  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.model import load_twin  # noqa: E402
from pendulum_twin.nodes.qos import LATEST, SAMPLES  # noqa: E402
from pendulum_twin.plans.excitation import Excitation, compute_command  # noqa: E402
from pendulum_twin.plans.plan_file import load_plan  # noqa: E402
from pendulum_twin.plans.plan_phases import Chirp, Push, Rest, Samples  # noqa: E402
from pendulum_twin.plans.waveforms import make_envelope  # noqa: E402

MODULE = "pendulum_bridge.nodes.excitation_node"
GENTLE = Samples(commands=(1e-3,) * 300, centred=False)  # some are sent, however long it stands


@pytest.fixture
def planned(tmp_path):
    """Return what writes a plan file of phases and returns its path."""
    return partial(written, tmp_path)


def expected(plan: Excitation, states: list[np.ndarray], lost: frozenset[int]) -> list[float]:
    """Return the command of each sample, worked out from all of them at hand."""
    way, sent = 0, []
    for k, (x, _, v, _) in enumerate(states):
        if k >= plan.push_ends and not way:
            way = int(math.copysign(1, x - states[0][0]))
        if k not in lost:
            sent.append(compute_command(plan, k, float(x), float(v), way))
    return sent


@pytest.mark.parametrize(
    "lost", [frozenset(), frozenset({40, 41, 100, 101, 102, 200})], ids=["none lost", "some lost"]
)
def test_command_k_answers_sample_k(
    ros: Graph, planned, monkeypatch: pytest.MonkeyPatch, lost: frozenset[int]
) -> None:
    """The rig's motion depends on every answer: an answer a sample late changes all after it."""
    path = planned(
        Push(seconds=0.9),
        Chirp(seconds=1.5, from_hz=1, to_hz=4, amplitude=0.4),
        Rest(seconds=0.2, centred=True),
    )
    plan = load_plan(path, make_envelope(load_twin(TWIN).rig))
    rig = StepRig(ros, lost)
    # this machine may stand still, which makes a push uneven
    monkeypatch.setattr("pendulum_bridge.nodes.excitation_node.monotonic", lambda: rig.now_s)
    node = make(ros, path, reset_first=False, overruled_s=60.0)
    rig.look(node)
    assert rig.answers == [0.0] * SAMPLES_A_LOOK and node._run.stage is Stage.PLAYING
    for kept in (rig.answers, rig.twins, rig.states):
        kept.clear()
    for k in range(len(plan.commands)):
        rig.move(k)
    assert rig.answers == expected(plan, rig.states, lost)
    assert rig.twins == rig.answers
    assert max(abs(x) for x, *_ in rig.states) > 0.02  # there was something to centre
    assert node._run.performance.playback.way == 1 and node._run.performance.playback.lost == len(
        lost
    )
    rig.move(-1)
    assert rig.answers[-1] == 0.0 and node._run.stage is Stage.DONE and node.end() is None


def test_samples_from_before_the_reset_never_belong_to_the_plan() -> None:
    """As many wait at most in the queues of the sender and of the reader."""
    assert 2 * SAMPLES.depth <= SAMPLES_QUEUED


def test_rig_and_twin_get_the_same_commands_in_real_time(ros: Graph, planned) -> None:
    """All but what a machine that stands still drops: a late reader gets the last command."""
    bench = Bench(ros)
    node = bench.play(planned(Rest(seconds=0.2), NUMBERED))
    assert bench.over(node) is None
    numbers = [
        [round(1e3 * command) for command in sent if command] for sent in bench.sent.values()
    ]
    assert all(sequence == sorted(set(sequence)) for sequence in numbers)
    assert len(set(numbers[0]) & set(numbers[1])) + node._run.performance.playback.lost >= 90
    ros.until(lambda: bench.progress[-1] == 1.0, "the last of the progress")
    assert node.end() is None


def test_both_are_reset_first_unless_told_otherwise(ros: Graph, planned) -> None:
    bench = Bench(ros)
    pusher = ros.user("pusher")
    commands = pusher.create_publisher(Float64, "/rig/pwm", LATEST)
    ros.until(
        lambda: commands.publish(Float64(data=0.4)) or (bench.carts and bench.carts[-1] > 0.05),
        "motion",
    )
    ros.remove(pusher)
    resets = []
    node = make(ros, planned(Rest(seconds=0.1)), silence_s=BUSY_S)
    ros.until(lambda: resets.append(node._run.stage) or node.over, "the end")
    assert Stage.RESETTING in resets and bench.over(node) is None
    # the longer queue of who watches may still hold samples from before the reset
    ros.until(lambda: abs(bench.carts[-1]) < 1e-12, "a cart in the middle")


def test_while_another_commands_the_rig_it_does_not_begin(ros: Graph, planned) -> None:
    bench = Bench(ros)
    other = ros.user("other")
    other.create_publisher(Float64, "/rig/pwm", LATEST)
    node = make(ros, planned(Rest(seconds=0.1)), silence_s=BUSY_S)
    ros.until(lambda: node._find_lacking() == "1 other(s) command /rig/pwm", "the other one")
    assert bench.sent == {"/rig": [], "/twin": []}
    ros.remove(other)
    assert bench.over(node) is None


def test_it_waits_for_as_many_nodes_as_it_is_told(ros: Graph, planned) -> None:
    """A node that listens twice is one."""
    bench = Bench(ros)
    bench.user.create_subscription(Float64, "/rig/pwm", print, LATEST)
    node = make(ros, planned(Rest(seconds=0.1)), listeners=3, silence_s=BUSY_S)
    ros.until(lambda: node._find_lacking() == "2 of 3 listen to /rig/pwm", "all but one")
    ros.user("recorder").create_subscription(Float64, "/rig/pwm", print, LATEST)
    assert bench.over(node) is None


@pytest.mark.parametrize("rate_hz", [50.0, 200])
def test_the_standard_plan_is_played_at_the_rigs_rate(ros: Graph, rate_hz: float) -> None:
    bench = Bench(ros, rig_rate_hz=float(rate_hz))
    node = make(ros, "", rate_hz=rate_hz, silence_s=BUSY_S, overruled_s=60.0, twin="")
    assert node._plan.rate_hz == rate_hz and node._plan.seconds == pytest.approx(60.0, abs=2.0)
    ros.until(lambda: node._run.stage in (Stage.PLAYING, Stage.STOPPED), "the plan")
    assert node._run.stage is Stage.PLAYING, node.end()
    assert bench.rig is not None


def test_it_waits_for_the_service_and_plays_again_when_asked(ros: Graph, planned) -> None:
    bench = Bench(ros)
    node = make(
        ros,
        planned(Rest(seconds=0.3)),
        start="service",
        exit_when_done=False,
        silence_s=BUSY_S,
        overruled_s=60.0,
    )
    start, abort = (bench.user.create_client(Trigger, name) for name in ("start", "abort"))
    assert ros.call(abort).message == "nothing to abort: the node waits to be started"
    for _ in range(2):
        assert ros.call(start).success
        again = ros.call(start)
        assert not again.success and again.message.endswith(" already")
        ros.until(lambda: node._run.stage is Stage.DONE, "the end")
        assert not node.over
    assert ros.call(start).success and ros.call(abort).success
    assert node._run.stage is Stage.STOPPED and not node.over
    assert ros.call(start).success
    ros.until(lambda: node._run.stage is Stage.DONE, "the end after an abort")
    assert node.end() is None


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"twin_file": ""},
            "twin_file: expected the path of the rig's twin file, found none: give -p "
            "twin_file:=FILE",
        ),
        ({"twin_file": "/no/such.yaml"}, "/no/such.yaml: expected a twin file"),
        ({"plan": "/no/such.yaml"}, "/no/such.yaml: expected a plan file, but it cannot be read"),
        ({"rig": ""}, "rig: expected a namespace such as /rig, found none"),
        ({"rig": "/my rig"}, "rig: expected a namespace such as /rig, found '/my rig'"),
        ({"twin": "//"}, "twin: expected a namespace such as /twin, found '//'"),
        (
            {"twin": "rig"},
            "twin: expected another namespace than that of the rig, found /rig for both",
        ),
        ({"start": "later"}, "start: expected one of auto, service, found 'later'"),
        ({"rail_share": 1.5}, "rail_share: expected a number from 0.01 to 1, found 1.5"),
        ({"silence_s": math.nan}, "silence_s: expected a number from 0.01 to 60, found nan"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(
    ros: Graph, values: dict, sentence: str
) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make(ros, values.pop("plan", ""), **values)


def start_program(ros: Graph, plan: str, *more: str) -> subprocess.Popen:
    values = {"twin_file": str(TWIN), "plan": plan, "silence_s": str(BUSY_S)}
    given = [part for name, value in values.items() for part in ("-p", f"{name}:={value}")]
    return ros.start(MODULE, "--ros-args", *given, *more)


def wait_for_end(ros: Graph, node: subprocess.Popen) -> tuple[int, str]:
    """Serve the graph until a program has ended; return its status and what it said on stderr."""
    ros.until(lambda: node.poll() is not None, "the end of the program")
    return node.returncode, node.communicate(timeout=DEADLINE_S)[1]


def test_a_program_that_has_played_all_ends_with_0(ros: Graph, planned) -> None:
    bench = Bench(ros)
    status, said = wait_for_end(ros, start_program(ros, planned(Rest(seconds=0.2), GENTLE)))
    assert status == 0 and "has played the plan" in said
    # the program may end before its last message arrives
    ros.until(lambda: bench.sent["/rig"][-1:] == [0.0], "a last command of 0")
    assert 1e-3 in bench.sent["/rig"]


def test_a_program_that_was_stopped_ends_with_1_and_why(ros: Graph, planned) -> None:
    bench = Bench(ros)
    status, said = wait_for_end(
        ros, start_program(ros, planned(PUSHED), "-p", "cart_limit_m_s:=0.2")
    )
    assert status == 1 and said.splitlines()[-1].startswith(
        "excitation_node: The cart is too fast ("
    )
    bench.ros.until(
        lambda: bench.sent["/rig"][-1:] == bench.sent["/twin"][-1:] == [0.0], "a last command of 0"
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_sends_0_and_ends_it(ros: Graph, planned, number: signal.Signals) -> None:
    bench = Bench(ros)
    node = start_program(ros, planned(PUSHED), "-p", "rail_share:=1.0")
    ros.until(lambda: 0.3 in bench.sent["/rig"], "the plan")
    node.send_signal(number)
    status, said = wait_for_end(ros, node)
    assert (
        status == 1
        and "The plan was interrupted by a signal (plays samples: " in said
        and "Traceback" not in said
    )
    ros.until(
        lambda: bench.sent["/rig"][-1:] == bench.sent["/twin"][-1:] == [0.0], "a last command of 0"
    )


def test_a_program_that_waits_for_its_service_ends_well(ros: Graph, planned) -> None:
    node = start_program(ros, planned(*LONG), "-p", "start:=service")
    starter = ros.user("starter").create_client(Trigger, "start")
    ros.until(starter.service_is_ready, "the program")
    node.send_signal(signal.SIGINT)
    assert wait_for_end(ros, node) == (0, "")

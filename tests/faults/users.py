"""Faults that users of ROS make or meet: files, first starts, clocks, plans, transitions, load."""

import os
import signal
import tempfile
import time
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from faults.bench import Bench, driver_arguments
from faults.row import Row
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from support.driven_rig import MODULE
from support.excitation_bench import BUSY_S, LONG, written
from support.excitation_bench import Bench as Twins
from support.real_time_user import TWIN, make_twin
from support.ros_graph import DEADLINE_S, Graph
from support.wire import Wire

from pendulum_twin.nodes.clock_watch import STANDS

TWIN_MODULE = "pendulum_twin.nodes.twin_node"
AT_ONCE_S = 0.1
STOOD_S = 0.31
COMPANION_S = 0.25


def wrong_parameter_file(ros: Graph) -> Row:
    """Start a driver with a missing file, and with a file whose limit is misspelt."""
    wire = Wire()
    try:
        with tempfile.TemporaryDirectory() as folder:
            misspelt = Path(folder) / "limits.yaml"
            misspelt.write_text("/**:\n  ros__parameters:\n    pwm_limt: 0.1\n")
            files = ((Path(folder) / "nope.yaml", 2), (misspelt, 1))
            for file, status in files:
                arguments = [*driver_arguments(wire), "--params-file", file]
                program = ros.start(MODULE, *arguments)
                _, said = program.communicate(timeout=DEADLINE_S)
                assert program.returncode == status, said
        assert not wire.commands and "the nearest name is pwm_limit" in said
    finally:
        wire.close()
    right = "ends with status 2 and 1 and a sentence; the rig gets no packet"
    return Row("missing, and misspelt, parameter file", None, right, said)


def cold_start_interrupted(ros: Graph) -> Row:
    """Interrupt the first start of a twin on a computer, while it compiles."""
    with tempfile.TemporaryDirectory() as cache:
        before, os.environ["XDG_CACHE_HOME"] = os.environ.get("XDG_CACHE_HOME"), cache
        try:
            program = ros.start(TWIN_MODULE, "--ros-args", "-p", f"twin:={TWIN}")
            said = [program.stderr.readline() for _ in range(2)]
            begin = time.monotonic()
            program.send_signal(signal.SIGINT)
            program.communicate(timeout=DEADLINE_S)
            ended_s = time.monotonic() - begin
        finally:
            del os.environ["XDG_CACHE_HOME"]
            if before is not None:
                os.environ["XDG_CACHE_HOME"] = before
    assert program.returncode == 0 and "compiling" in said[0]
    right = f"ends with status 0 after {1e3 * ended_s:.0f} ms; nothing half made is kept"
    return Row("Ctrl-C while the first start compiles", None, right, said[0])


def no_clock(ros: Graph) -> Row:
    """Run a twin with use_sim_time while nobody publishes /clock."""
    said: list[str] = []
    ros.user("listener").create_subscription(
        DiagnosticArray, "/diagnostics", lambda m: said.extend(s.message for s in m.status), 10
    )
    make_twin(ros, use_sim_time=True)
    ros.until(lambda: STANDS in said, "the sentence")
    return Row("use_sim_time without /clock", None, "the twin says so, and what to do", STANDS)


def plan_given_up(ros: Graph) -> Row:
    """Abort a plan under way."""
    with tempfile.TemporaryDirectory() as folder:
        twins = Twins(ros)
        sent: list[tuple[float, float]] = []
        listener = ros.user("listener")
        note = lambda message: sent.append((time.monotonic(), message.data))  # noqa: E731
        listener.create_subscription(Float64, "/rig/pwm", note, 1000)
        node = twins.play(written(Path(folder), *LONG), listeners=2, silence_s=BUSY_S)
        ros.until(lambda: any(pwm for _, pwm in sent), "the plan to push")
        begin = time.monotonic()
        assert node.on_abort(Trigger.Request(), Trigger.Response()).success
        ros.until(lambda: node.over and sent[-1][1] == 0.0, "PWM 0")
        last = next(at for k, (at, _) in enumerate(sent) if not any(p for _, p in sent[k:]))
        said = node.end() or ""
    right = "its last command is 0; it ends with status 1, and the recording is told"
    return Row("plan given up", max(last - begin, 0.0), right, said)


def computer_stands_still(bench: Bench) -> Row:
    """Stop the driver for a third of a second, as a busy computer does."""
    bench.driver.send_signal(signal.SIGSTOP)
    begin = time.monotonic()
    try:
        zero_s = bench.zero_after(begin, COMPANION_S, bench.drive)
        bench.spin(max(STOOD_S - (time.monotonic() - begin), 0.0), bench.drive)
    finally:
        bench.driver.send_signal(signal.SIGCONT)
    told = "This computer stood still for "
    bench.until(lambda: any(told in s for s in bench.sentences), "its sentence", bench.drive)
    said = next(sentence for sentence in bench.sentences if told in sentence)
    bench.recovers()
    right = "its companion sends PWM 0; the driver names the standstill and drives on"
    return Row("the computer stands still", zero_s, right, said)


def deactivated_under_load(bench: Bench) -> Row:
    """Deactivate the driver amid a flood of commands, and activate it again."""
    change = bench.user.node.create_client(ChangeState, "/driver/change_state")

    def set_state(transition: int) -> None:
        request = ChangeState.Request(transition=Transition(id=transition))
        assert bench.ros.call(change, request).success

    def flood() -> None:
        for _ in range(20):
            bench.user.send(bench.wave())
        bench.ros.spin()

    bench.ros.until(change.service_is_ready, "the service")
    bench.spin(0.3, flood)
    for _ in range(20):
        bench.user.send(bench.wave())
    begin = time.monotonic()
    set_state(Transition.TRANSITION_DEACTIVATE)
    zero_s = bench.zero_after(begin, AT_ONCE_S, flood)
    said = "The driver is not active"
    bench.until(lambda: any(said in s for s in bench.sentences), "its sentence", flood)
    said = next(sentence for sentence in bench.sentences if said in sentence)
    set_state(Transition.TRANSITION_ACTIVATE)
    bench.recovers()
    right = "PWM 0 while the flood goes on; drives again once it is active"
    return Row("ros2 lifecycle set deactivate, under a flood of commands", zero_s, right, said)

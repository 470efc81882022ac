"""Faults that need a bench of their own: clocks, the excitation, a thousand resets."""

import tempfile
import time
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

from builtin_interfaces.msg import Time
from faults.bench import Bench
from faults.packets import spoiling
from faults.row import Row
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from support.driven_rig import MODULE, DrivenEmulator, arguments_for
from support.excitation_bench import BUSY_S, LONG, written
from support.excitation_bench import Bench as Twins
from support.ros_graph import Graph
from support.running_emulator import TWIN

from pendulum_bridge.driver.arrival_clock import ArrivalClock
from pendulum_bridge.excitation.guard import StopReason
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.wire.protocol import Sample
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.qos import SAMPLES

HOUR_S = 3600
PERIOD_NS = 10_000_000
RATE_HZ = 1000
GROWTH_KIB = 2048  # of memory, at most
TRIES = 3  # on a computer that may stand still
END_M = 0.01  # a cart this near the end has come to it


def ros_clock_jumps(ros: Graph) -> Row:
    """Jump with /clock; the system's clock cannot be set by a test."""
    with closing(Bench(ros, use_sim_time="true")) as bench:
        clock = bench.user.node.create_publisher(Clock, "/clock", 10)
        bench.until(clock.get_subscription_count, "the driver to listen to /clock", bench.drive)
        now_s = 10 * HOUR_S
        bench.ready()
        begin = time.monotonic()
        for step_s in (HOUR_S, -HOUR_S, -HOUR_S, HOUR_S):
            now_s += step_s
            clock.publish(Clock(clock=Time(sec=now_s)))
            bench.spin(0.2, bench.drive)
        bench.goes_on(begin, 0.2)
        zero_s = bench.zero_after(time.monotonic(), 0.2)  # and its watchdog still bites
        bench.user.healths.clear()
        said = bench.said(Reason.COMMAND_OLD)
    return Row(
        "ROS clock jumps by 1 h, both ways (use_sim_time)",
        zero_s,
        "goes on; then the user stops commanding",
        said,
    )


def mirrored_encoder(ros: Graph) -> Row:
    """Let the cart's encoder count the other way than the twin file says, and push to the end.

    A computer that stands still while the cart is to be braked lets it through: push again then.
    """
    half_m = load_twin(TWIN).rig.rail_half_length_m
    assert half_m is not None
    for _ in range(TRIES):
        far_m, said = _push_mirrored(ros)
        if far_m < half_m - END_M:
            break
    assert far_m < half_m - END_M, (
        f"the cart came to the end of the rail in {TRIES} of {TRIES} pushes"
    )
    right = f"goes on; the rail guard keeps the cart on the rail ({far_m:.2f} of {half_m:g} m)"
    return Row("encoder of the cart counts the other way, a steady push", None, right, said)


def _push_mirrored(ros: Graph) -> tuple[float, str]:
    """Return how far from the middle the cart came, m, and what the driver said."""

    def mirror(sample: Sample) -> Sample:
        return replace(sample, cart_m=-sample.cart_m, cart_velocity=-sample.cart_velocity)

    with closing(Bench(ros)) as bench:
        bench.wire.spoil = spoiling(mirror)
        both_ways = lambda: bench.send(bench.wave(0.3, way=-1))  # noqa: E731
        said = bench.said(Reason.CART_MIRRORED, step=both_ways)
        bench.spin(3.0, partial(bench.send, 0.3))
        begin = time.monotonic()
        bench.goes_on(begin, 0.5, partial(bench.send, -0.3))
        bench.driver.kill()  # the next push has a driver of its own
        bench.driver.communicate()
        return max(abs(state.position[0]) for state in bench.user.states), said


def system_clock_jumps() -> Row:
    """Set the clock that stamps samples: a pure function, as only the administrator may set it."""
    for jump_ns in (HOUR_S * 10**9, -HOUR_S * 10**9):
        clock = ArrivalClock(100.0)
        arrival = time.time_ns()
        for _ in range(100):
            arrival += PERIOD_NS
            clock.stamp(arrival)
        for _ in range(100):
            arrival += PERIOD_NS
            stamp = clock.stamp(arrival + jump_ns)
            assert abs(stamp - arrival - jump_ns) < PERIOD_NS
        assert (clock.timing.begun, clock.timing.set_back) == (1, int(jump_ns < 0))
    right = (
        "stamps follow from the next sample on (ArrivalClock alone); PWM is decided by the "
        "monotonic clock, which also bounds how old a sample can be"
    )
    return Row("the system's clock is set by 1 h, both ways", None, right)


def empty_sample(ros: Graph) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        twins = Twins(ros)
        sent: list[tuple[float, float]] = []
        listener = ros.user("listener")
        note = lambda message: sent.append((time.monotonic(), message.data))  # noqa: E731
        listener.create_subscription(Float64, "/rig/pwm", note, 1000)
        states = listener.create_publisher(JointState, "/rig/joint_states", SAMPLES)
        node = twins.play(written(Path(folder), *LONG), listeners=3, silence_s=BUSY_S)
        ros.until(
            lambda: states.get_subscription_count() >= 2 and any(pwm for _, pwm in sent),
            "the plan to push",
        )
        begin = time.monotonic()
        states.publish(JointState())
        ros.until(lambda: node.over and sent[-1][1] == 0.0, "PWM 0")
        assert (
            node._run.stopped is not None
            and node._run.stopped.reason is StopReason.SAMPLE_MALFORMED
        )
        zero_s = (
            next(at for k, (at, _) in enumerate(sent) if not any(pwm for _, pwm in sent[k:]))
            - begin
        )
        said = node.end() or ""
    return Row(
        "empty JointState to the excitation",
        zero_s,
        "it stops; its last command, to twin and rig, is 0",
        said,
    )


def resets(ros: Graph, count: int = 100) -> Row:
    """Reset a hanging pendulum over and over, after a warm-up of as many resets, at most 100."""
    rig = DrivenEmulator("--rate", RATE_HZ)
    try:
        patient = {"rate_hz": RATE_HZ, "rig_timeout_s": 2.0, "reset_deadline_s": 90.0}
        driver = ros.start(MODULE, *arguments_for(rig, **patient))
        client = ros.user().create_client(Trigger, "reset")
        _reset(ros, client, 1)
        _reset(ros, client, min(count, 100))
        before, begin = _read_usage(driver.pid), time.monotonic()
        _reset(ros, client, count)
        each_s, after = (time.monotonic() - begin) / count, _read_usage(driver.pid)
    finally:
        rig.kill()
    assert after[:2] == before[:2], f"files and threads: {before[:2]} before, {after[:2]} after"
    grown_kib = after[2] - before[2]
    assert grown_kib < GROWTH_KIB, f"memory grew by {grown_kib} KiB in {count} resets"
    right = (
        f"{after[0]} files and {after[1]} threads before and after; memory grew by {grown_kib} "
        f"KiB of {before[2]}; "
        f"{1e3 * each_s:.0f} ms each"
    )
    return Row(f"{count:,} resets without a leak", None, right, Reason.RESET_DONE.sentence)


def _reset(ros: Graph, client, count: int) -> None:
    for _ in range(count):
        answer = ros.call(client)
        assert answer.success, answer.message


def _read_usage(process: int) -> tuple[int, int, int]:
    """Return how many files and threads a process has, and its memory in KiB."""
    proc = Path(f"/proc/{process}")
    memory = next(
        row for row in (proc / "status").read_text().splitlines() if row.startswith("VmRSS")
    )
    return (
        len(list((proc / "fd").iterdir())),
        len(list((proc / "task").iterdir())),
        int(memory.split()[1]),
    )

"""Faults of the rig, of its encoders, and of the wire."""

import math
import random
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

from faults.bench import DEADLINE_S, Bench
from faults.row import Row

from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.wire.protocol import SAMPLE, Sample

TIMEOUT_S = 0.2
AT_ONCE_S = 0.05  # from the spoilt sample, which may come a period later
STUCK_S = 1.0  # a whirling pole may take up a push of 0.4 for so long
Changed = Callable[[Sample], Sample]


def spoiling(change: Changed) -> Callable[[bytes], list[bytes]]:
    return lambda packet: [change(Sample.unpack(packet)).pack()]


def spoilt(
    bench: Bench,
    spoil: Callable[[bytes], list[bytes]],
    limit_s: float,
    *expected: Reason,
    step=None,
):
    """Return after how long there was PWM 0 with all samples spoilt, and what was said."""
    step = step or bench.drive
    bench.wire.spoil = spoil
    begin = time.monotonic()
    return bench.zero_after(begin, limit_s, step), bench.said(*expected, step=step)


def nan_packets(bench: Bench) -> Row:
    before = bench.counted("packets_malformed", bench.drive)
    packet = SAMPLE.pack(math.nan, 0.0, 0.0, 0.0)
    zero_s, said = spoilt(bench, lambda _: [packet], TIMEOUT_S, Reason.RIG_SILENT)
    assert bench.counted("packets_malformed", bench.drive) > before + 10
    bench.recovers()
    return Row(
        "malformed packets: every sample holds NaN",
        zero_s,
        "none is taken: the rig counts as silent",
        said,
    )


def random_packets(bench: Bench) -> Row:
    source = random.Random(0)
    zero_s, said = spoilt(
        bench,
        lambda _: [source.randbytes(SAMPLE.size)],
        TIMEOUT_S,
        Reason.ENCODER_JUMPED,
        Reason.RIG_SILENT,
    )
    bench.spin(0.5, bench.drive)
    assert Reason.FAILED.sentence not in bench.sentences
    bench.clear()
    bench.recovers()
    return Row(
        "malformed packets: random bytes of the right length",
        zero_s,
        "absurd numbers are refused, others are no motion: PWM 0; goes on when cleared",
        said,
    )


def short_packets(bench: Bench) -> Row:
    before = bench.counted("packets_malformed", bench.drive)
    zero_s, said = spoilt(bench, lambda packet: [packet[:16], b""], TIMEOUT_S, Reason.RIG_SILENT)
    assert bench.counted("packets_malformed", bench.drive) > before + 10
    bench.recovers()
    return Row(
        "short packets: 16 bytes, and none",
        zero_s,
        "none is taken: the rig counts as silent",
        said,
    )


def foreign_packets(bench: Bench) -> Row:
    before = bench.counted("packets_foreign", bench.drive)
    packet = Sample(pole_rad=0.0, pole_rate=9.0, cart_m=0.8, cart_velocity=3.0).pack()

    def step() -> None:
        bench.wire.send_foreign(packet)
        bench.drive()

    begin, seen = time.monotonic(), len(bench.user.states)
    bench.goes_on(begin, step=step)
    assert all(state.position[0] != 0.8 for state in bench.user.states[seen:])
    foreign = bench.counted("packets_foreign", step) - before
    assert foreign > 50
    right = f"goes on; none is taken or published, {foreign:.0f} counted"
    return Row(
        "foreign packets: samples from another host", None, right, bench.user.healths[-1].message
    )


def reordered_packets(bench: Bench) -> Row:
    stored: list[bytes] = []

    def swap(packet: bytes) -> list[bytes]:
        stored.append(packet)
        if len(stored) < 2:
            return []
        pair = stored[::-1]
        stored.clear()
        return pair

    bench.wire.spoil = swap
    begin, seen = time.monotonic(), len(bench.user.states)
    bench.goes_on(begin, 1.5)
    stamps = [
        state.header.stamp.sec + 1e-9 * state.header.stamp.nanosec
        for state in bench.user.states[seen:]
    ]
    assert all(b > a for a, b in pairwise(stamps))
    said = bench.user.healths[-1].message
    bench.recovers()
    return Row(
        "reordered packets: each pair of samples swapped", None, "goes on; stamps rise", said
    )


def silence(bench: Bench) -> Row:
    zero_s, said = spoilt(bench, lambda _: [], TIMEOUT_S, Reason.RIG_SILENT)
    answer = bench.user.call("reset")
    assert not answer.success and answer.message == Reason.RESET_SILENT.sentence
    bench.recovers()
    return Row(
        "silence of the rig",
        zero_s,
        "PWM 0; a reset is refused; goes on when the rig is back",
        said,
    )


def rig_restarts(bench: Bench) -> Row:
    bench.rig.kill()
    begin = time.monotonic()
    bench.rig.communicate()
    zero_s = bench.zero_after(begin, TIMEOUT_S, bench.drive)
    said = bench.said(Reason.RIG_SILENT, step=bench.drive)
    bench.start_rig()
    bench.recovers()
    return Row(
        "the rig is killed and starts again", zero_s, "PWM 0; goes on when the rig is back", said
    )


def encoder_jump(bench: Bench) -> Row:
    off = spoiling(lambda sample: replace(sample, cart_m=sample.cart_m + 0.2))
    zero_s, said = spoilt(bench, off, AT_ONCE_S, Reason.ENCODER_JUMPED)
    return _latched(
        bench, Row("encoder jump: the cart reads 0.2 m more from now on", zero_s, "PWM 0", said)
    )


def encoder_stuck(bench: Bench) -> Row:
    push = -math.copysign(0.4, bench.user.states[-1].position[0])
    stored: list[float] = []

    def stuck(sample: Sample) -> Sample:
        stored.append(sample.cart_m)
        return replace(sample, cart_m=stored[0], cart_velocity=0.0)

    zero_s, said = spoilt(
        bench, spoiling(stuck), STUCK_S, Reason.CART_STUCK, step=lambda: bench.send(push)
    )
    return _latched(
        bench,
        Row("stuck encoder: the cart's reading stays while 0.4 pushes it", zero_s, "PWM 0", said),
    )


def same_sample(bench: Bench) -> Row:
    stored: list[bytes] = []

    def same(packet: bytes) -> list[bytes]:
        stored.append(packet)
        return [stored[0]]

    bench.until(lambda: abs(bench.user.states[-1].velocity[0]) > 0.05, "motion", bench.drive)
    zero_s, said = spoilt(bench, same, STUCK_S, Reason.CART_STUCK, Reason.POLE_STUCK)
    return _latched(
        bench, Row("stuck rig: the same sample again and again", zero_s, "PWM 0", said)
    )


def _latched(bench: Bench, row: Row) -> Row:
    """See that the fault stays until somebody has looked."""
    begin = time.monotonic()
    bench.spin(0.4, bench.drive)
    assert {sent.pwm for sent in bench.wire.since(begin)} == {0.0}
    bench.clear()
    bench.recovers()
    return replace(row, right=f"{row.right}, until the stop has been pressed and cleared")


def silence_in_reset(bench: Bench) -> Row:
    pending = bench.user.ask("reset")
    moved = time.monotonic()
    bench.until(
        lambda: any(abs(sent.pwm) not in (0.0, 0.1) for sent in bench.wire.since(moved)),
        "the reset to drive",
    )
    bench.wire.spoil = lambda _: []
    begin = time.monotonic()
    zero_s = bench.zero_after(begin, TIMEOUT_S)
    bench.until(pending.done, "the answer")
    assert (
        pending.result().message == Reason.RESET_SILENT.sentence
        and time.monotonic() < begin + DEADLINE_S
    )
    bench.recovers()
    return Row(
        "silence of the rig in a reset",
        zero_s,
        "PWM 0; the reset is given up and answered",
        pending.result().message,
    )

"""The link over real sockets: deadlines are kept; packets of others are dropped and counted."""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from pendulum_bridge.wire.link import Counts, Link
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_bridge.wire.receive_time import SO_TIMESTAMPNS, read_arrival_ns
from pendulum_bridge.wire.udp import RIG, USER, Address, parse_address
from pendulum_twin.errors import BadInputError

LONG_S = 120.0
SAMPLE, OTHER = Sample(3.0, 0.1, 0.2, -0.3), Sample(3.1, 0.2, 0.3, -0.4)


def find_free_address() -> Address:
    with open_socket() as probe:
        return Address("127.0.0.1", probe.getsockname()[1])


def open_socket(host: str = "127.0.0.1") -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind((host, 0))
    opened.settimeout(LONG_S)
    return opened


@dataclass
class Bench:
    """A link, and a bare socket in the rig's place."""

    link: Link
    rig: socket.socket
    user: tuple[str, int]

    def send_to_user(self, packet: bytes) -> None:
        self.rig.sendto(packet, self.user)

    def receive(self, wait_s: float = LONG_S) -> Sample | None:
        return self.link.receive(time.monotonic() + wait_s)


@pytest.fixture
def bench() -> Iterator[Bench]:
    user = find_free_address()
    with open_socket() as rig, Link(user, Address(*rig.getsockname())) as link:
        yield Bench(link, rig, (user.host, user.port))


def test_defaults_are_the_protocols_and_loopback() -> None:
    assert (str(RIG), str(USER)) == ("127.0.0.1:16384", "127.0.0.1:16385")


def test_a_command_goes_out_and_samples_come_in_order(bench: Bench) -> None:
    bench.link.send(Command(0.25, True))
    assert bench.rig.recv(64) == struct.pack(">dd", 0.25, 1.0)
    bench.send_to_user(SAMPLE.pack())
    bench.send_to_user(OTHER.pack())
    assert [bench.receive(), bench.receive()] == [SAMPLE, OTHER]
    assert bench.link.counts == Counts(received=2)


def test_a_sample_has_the_time_at_which_it_came_not_that_of_reading(bench: Bench) -> None:
    """The kernel begins to note times a moment after it was asked: so again until it does."""
    end = time.monotonic() + LONG_S
    while time.monotonic() < end:
        before_ns = time.time_ns()
        bench.send_to_user(SAMPLE.pack())
        after_ns = time.time_ns()
        while time.time_ns() < after_ns + 20_000_000:
            pass
        arrival = bench.link.receive_stamped(time.monotonic() + LONG_S)
        assert arrival is not None and arrival.sample == SAMPLE
        if before_ns <= arrival.arrival_ns <= after_ns:
            return
    pytest.fail(f"the time was {arrival.arrival_ns - after_ns} ns after the sending")


def test_without_the_kernels_time_it_is_that_of_reading() -> None:
    before_ns = time.time_ns()
    for ancillary in (
        [],
        [(socket.SOL_SOCKET, 99, bytes(16))],
        [(socket.SOL_SOCKET, SO_TIMESTAMPNS, b"short")],
    ):
        assert before_ns <= read_arrival_ns(ancillary) <= time.time_ns()
    given = struct.pack("@qq", 12, 345)
    assert read_arrival_ns([(socket.SOL_SOCKET, SO_TIMESTAMPNS, given)]) == 12_000_000_345


def test_no_arrival_at_the_deadline(bench: Bench) -> None:
    assert bench.link.receive_stamped(time.monotonic() + 0.01) is None
    assert bench.link.counts == Counts(lost=1)


def test_the_link_says_where_it_sends_and_never_changes_its_socket(bench: Bench) -> None:
    link = bench.link
    assert (link.connected, link.trouble, link.connections, link.peer) == (
        True,
        "",
        1,
        bench.rig.getsockname(),
    )
    assert socket.socket(fileno=socket.dup(link.fileno())).getsockname() == bench.user


@pytest.mark.wall_time
def test_silence_ends_at_the_deadline(bench: Bench) -> None:
    start = time.monotonic()
    assert bench.receive(0.05) is None
    took = time.monotonic() - start
    assert 0.05 <= took < 1.0
    assert bench.receive(-1.0) is None  # a deadline that has passed does not wait
    assert bench.link.counts == Counts(lost=2)


def test_a_deadline_that_has_passed_takes_what_is_there(bench: Bench) -> None:
    bench.send_to_user(SAMPLE.pack())
    end = time.monotonic() + LONG_S
    received = None
    while received is None and time.monotonic() < end:
        received = bench.receive(-1.0)
    assert received == SAMPLE


@pytest.mark.parametrize(
    "junk", [b"", b"x" * 31, b"x" * 33, b"x" * 5000, struct.pack(">dddd", 0, 0, float("nan"), 0)]
)
def test_malformed_packets_are_dropped_and_counted(bench: Bench, junk: bytes) -> None:
    bench.send_to_user(junk)
    bench.send_to_user(SAMPLE.pack())
    assert bench.receive() == SAMPLE
    assert bench.link.counts == Counts(received=1, malformed=1)


def test_packets_of_another_host_are_dropped_and_counted(bench: Bench) -> None:
    with open_socket("127.0.0.2") as stranger:
        stranger.sendto(OTHER.pack(), bench.user)
    bench.send_to_user(SAMPLE.pack())
    assert bench.receive() == SAMPLE
    assert bench.link.counts == Counts(received=1, foreign=1)


def test_a_rig_may_send_from_any_port_unless_one_is_named() -> None:
    user = find_free_address()
    with open_socket() as rig, open_socket() as other:
        with Link(user, Address(*rig.getsockname())) as link:
            other.sendto(OTHER.pack(), (user.host, user.port))
            assert link.receive(time.monotonic() + LONG_S) == OTHER
        with Link(user, Address(*rig.getsockname()), rig_port=rig.getsockname()[1]) as link:
            other.sendto(OTHER.pack(), (user.host, user.port))
            rig.sendto(SAMPLE.pack(), (user.host, user.port))
            assert link.receive(time.monotonic() + LONG_S) == SAMPLE
            assert link.counts == Counts(received=1, foreign=1)


@pytest.mark.wall_time
def test_a_flood_of_foreign_packets_does_not_hold_up_the_deadline(bench: Bench) -> None:
    stop = threading.Event()

    def flood() -> None:
        with open_socket("127.0.0.2") as stranger, contextlib.suppress(OSError):
            while not stop.is_set():
                stranger.sendto(OTHER.pack(), bench.user)

    thread = threading.Thread(target=flood)
    thread.start()
    try:
        start = time.monotonic()
        assert bench.receive(0.2) is None
        assert time.monotonic() - start < 2.0
        start = time.monotonic()
        bench.link.drop_waiting()  # ends although there is always another packet
        assert time.monotonic() - start < 5.0
    finally:
        stop.set()
        thread.join()
    assert bench.link.counts.foreign > 10


def test_a_sample_from_before_the_command_is_never_its_answer(bench: Bench) -> None:
    bench.send_to_user(OTHER.pack())
    wait_until_delivered(bench)

    def answer() -> None:
        assert bench.rig.recv(64) == Command(0.1).pack()
        bench.send_to_user(SAMPLE.pack())

    thread = threading.Thread(target=answer)
    thread.start()
    assert bench.link.exchange(Command(0.1), LONG_S) == SAMPLE
    thread.join()
    assert bench.link.counts == Counts(received=1, late=1)


def wait_until_delivered(bench: Bench) -> None:
    """Return once sent packets lie in the link's socket: loopback delivers within the call."""
    with open_socket() as probe:
        probe.sendto(b"", probe.getsockname())
        probe.recv(1)


def test_an_exchange_without_an_answer_is_lost(bench: Bench) -> None:
    assert bench.link.exchange(Command(0.1), 0.02) is None
    assert bench.link.counts == Counts(lost=1)


def test_an_address_in_use_is_one_sentence() -> None:
    with open_socket() as taken:
        address = Address(*taken.getsockname())
        with pytest.raises(
            BadInputError,
            match=f"cannot listen on {address}: Address already in use; choose another",
        ):
            Link(address)


@pytest.mark.parametrize(
    "text",
    ["", "16384", ":16384", "localhost:", "localhost:0", "localhost:65536", "localhost:x", "a:²"],
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(
        BadInputError, match="expected HOST:PORT with a port from 1 to 65535, found"
    ):
        parse_address(text)


def test_an_address_is_read_and_an_unknown_host_refused() -> None:
    assert parse_address("localhost:16384") == Address("localhost", 16384)
    with pytest.raises(
        BadInputError, match=r"expected a host name or IPv4 address, found 'no\.such"
    ):
        Link(find_free_address(), Address("no.such.invalid", 1))

"""The link over TCP: frames are found in the stream; a broken connection holds nobody up."""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.running_emulator import LONG_S, Emulator

from pendulum_bridge.emulator.tcp_server import TcpServer
from pendulum_bridge.wire.link import Counts, Link
from pendulum_bridge.wire.protocol import COMMAND, SAMPLE, Command, Sample
from pendulum_bridge.wire.stream import Stream
from pendulum_bridge.wire.tcp import TcpPort, open_tcp_link
from pendulum_bridge.wire.udp import Address
from pendulum_twin.errors import BadInputError

A_MOMENT_S = 2.0  # nothing that must not wait takes so long, on however busy a machine
SAMPLES = [Sample(3.0 + 0.1 * k, 0.1, 0.2, -0.3) for k in range(20)]


def open_listener(port: int = 0) -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    opened.bind(("127.0.0.1", port))
    opened.settimeout(LONG_S)
    opened.listen()
    return opened


@dataclass
class Bench:
    """A link, and bare sockets in the rig's place: a listening and a connected socket."""

    link: Link
    listening: socket.socket
    rig: socket.socket

    def receive(self, wait_s: float = LONG_S) -> Sample | None:
        return self.link.receive(time.monotonic() + wait_s)

    def command(self) -> bytes:
        return self.rig.recv(COMMAND.size, socket.MSG_WAITALL)


@pytest.fixture
def bench() -> Iterator[Bench]:
    with (
        open_listener() as listening,
        contextlib.closing(open_tcp_link(Address(*listening.getsockname()))) as link,
    ):
        made = Bench(link, listening, listening.accept()[0])
        made.rig.settimeout(LONG_S)
        yield made
        made.rig.close()


def test_a_command_goes_out_and_samples_come_in_order(bench: Bench) -> None:
    assert (bench.link.connected, bench.link.trouble, bench.link.connections, bench.link.peer) == (
        True,
        "",
        1,
        None,
    )
    bench.link.send(Command(0.25, True))
    bench.link.send(Command(-0.25))
    assert [bench.command(), bench.command()] == [
        Command(0.25, True).pack(),
        Command(-0.25).pack(),
    ]
    bench.rig.sendall(b"".join(sample.pack() for sample in SAMPLES))
    assert [bench.receive() for _ in SAMPLES] == SAMPLES
    assert bench.link.counts == Counts(received=len(SAMPLES))


def test_a_sample_in_pieces_is_one_sample(bench: Bench) -> None:
    bench.rig.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    for sample in SAMPLES[:3]:
        for byte in sample.pack()[:-1]:
            bench.rig.send(bytes([byte]))
        assert bench.receive(0.01) is None
        bench.rig.send(sample.pack()[-1:])
        assert bench.receive() == sample
    assert bench.link.counts == Counts(received=3, lost=3)


def test_a_frame_that_holds_no_sample_is_counted_and_the_next_is_read(bench: Bench) -> None:
    bench.rig.sendall(
        SAMPLE.pack(0, float("nan"), 0, 0) + SAMPLES[0].pack() + SAMPLE.pack(0, 0, float("inf"), 0)
    )
    bench.rig.sendall(SAMPLES[1].pack())
    assert [bench.receive(), bench.receive()] == SAMPLES[:2]
    assert bench.link.counts == Counts(received=2, malformed=2)


def test_a_sample_has_the_time_at_which_it_came(bench: Bench) -> None:
    before_ns = time.time_ns()
    bench.rig.sendall(SAMPLES[0].pack())
    arrival = bench.link.receive_stamped(time.monotonic() + LONG_S)
    assert arrival is not None and arrival.sample == SAMPLES[0]
    assert before_ns <= arrival.arrival_ns <= time.time_ns()


@pytest.mark.wall_time
def test_silence_ends_at_the_deadline(bench: Bench) -> None:
    begin = time.monotonic()
    assert bench.receive(0.05) is None and bench.receive(-1.0) is None
    assert 0.05 <= time.monotonic() - begin < A_MOMENT_S


def test_a_sample_from_before_the_command_is_never_its_answer(bench: Bench) -> None:
    bench.rig.sendall(SAMPLES[0].pack())

    def answer() -> None:
        assert bench.command() == Command(0.1).pack()
        bench.rig.sendall(SAMPLES[1].pack())

    thread = threading.Thread(target=answer)
    thread.start()
    assert bench.link.exchange(Command(0.1), LONG_S) == SAMPLES[1]
    thread.join()
    assert bench.link.counts == Counts(received=1, late=1)


@pytest.mark.wall_time
def test_who_does_not_read_holds_nobody_up_and_gets_whole_frames() -> None:
    size, count = 1000, 20_000
    with open_listener() as listening, socket.create_connection(listening.getsockname()) as other:
        stream = Stream(listening.accept()[0], size)
        begin = time.monotonic()
        for k in range(1, count):
            stream.send(k.to_bytes(4, "big") * (size // 4))
        assert time.monotonic() - begin < A_MOMENT_S
        came = read_all(other)
        stream.send(bytes(size))  # after what is left of a frame
        stream.close()
        came += read_all(other)
    assert len(came) % size == 0
    frames = [came[k : k + size] for k in range(0, len(came), size)]
    numbers = [int.from_bytes(frame[:4], "big") for frame in frames]
    assert frames == [k.to_bytes(4, "big") * (size // 4) for k in numbers]
    assert (
        numbers[-1] == 0
        and numbers[:-1] == sorted(set(numbers[:-1]))
        and 100 < len(numbers) < count - 100
    )


def read_all(connected: socket.socket) -> bytes:
    """Return all that comes until nothing has come for a while."""
    connected.settimeout(0.2)
    came = bytearray()
    with contextlib.suppress(TimeoutError):
        while part := connected.recv(1 << 20):
            came += part
    return bytes(came)


def check_refused(link: Link, why: str) -> None:
    assert not link.connected and why in link.trouble and link.fileno() == -1
    begin = time.monotonic()
    with pytest.raises(BadInputError, match=why):
        link.send(Command(0.5))
    assert link.receive(time.monotonic() - 1.0) is None and link.drop_waiting() == 0
    assert time.monotonic() - begin < A_MOMENT_S


@pytest.mark.wall_time
def test_nobody_there_is_a_sentence_and_is_found_once_there() -> None:
    with open_listener() as probe:
        port = probe.getsockname()[1]
    link = open_tcp_link(Address("127.0.0.1", port))
    check_refused(
        link,
        f"cannot connect to 127.0.0.1:{port}: Connection refused; see that the rig is on and "
        "listens there over TCP",
    )
    begin = time.monotonic()
    assert link.receive(begin + 0.5) is None  # keeps trying, and keeps to the deadline
    assert 0.5 <= time.monotonic() - begin < 0.5 + A_MOMENT_S
    with open_listener(port) as listening:
        assert link.receive(time.monotonic() + 0.5) is None
        rig, _ = listening.accept()
        rig.sendall(SAMPLES[0].pack())
        assert link.receive(time.monotonic() + LONG_S) == SAMPLES[0]
        assert (link.connected, link.connections) == (True, 1)
        link.close()
        check_refused(link, "closed")
        rig.close()


@pytest.mark.wall_time
def test_a_broken_connection_is_a_sentence_and_is_made_anew(bench: Bench) -> None:
    bench.rig.sendall(SAMPLES[0].pack() + SAMPLES[1].pack()[:20])
    bench.rig.close()
    assert bench.receive() == SAMPLES[0]  # what came before the end is not lost
    assert bench.receive(0.02) is None
    check_refused(
        bench.link,
        f"the connection to {Address(*bench.listening.getsockname())} broke: closed by the other "
        "side; the rig",
    )
    assert bench.receive(0.5) is None
    rig, _ = bench.listening.accept()
    rig.sendall(SAMPLES[2].pack())  # half a frame of the last connection does not spoil this one
    assert bench.receive() == SAMPLES[2]
    assert (bench.link.connected, bench.link.connections, bench.link.trouble) == (True, 2, "")
    rig.close()


def test_sending_into_a_broken_connection_is_a_sentence(bench: Bench) -> None:
    bench.rig.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    bench.rig.close()  # resets the connection
    with pytest.raises(BadInputError, match=r"cannot send to 127\.0\.0\.1:\d+: "):
        for _ in range(10):
            bench.link.send(Command(0.1))
    assert bench.receive(0.02) is None
    assert not bench.link.connected


def test_closing_ends_the_connection_though_another_process_holds_the_socket(bench: Bench) -> None:
    with socket.socket(fileno=socket.dup(bench.link.fileno())):
        bench.link.close()
        assert bench.rig.recv(1) == b""


def test_a_rig_that_never_answers_the_connection_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A listener with a full backlog does not answer: the same as a host that is switched off."""
    monkeypatch.setattr("pendulum_bridge.wire.tcp.CONNECT_S", 0.1)
    with socket.socket() as silent, contextlib.ExitStack() as waiting:
        silent.bind(("127.0.0.1", 0))
        silent.listen(0)
        for _ in range(4):
            other = waiting.enter_context(socket.socket())
            other.setblocking(False)
            other.connect_ex(silent.getsockname())
        port = TcpPort(Address(*silent.getsockname()), SAMPLE.size, Sample.unpack)
        assert port.receive(time.monotonic() + 0.3) is None
        assert "no answer; see that the rig is on" in port.trouble
        port.close()


def test_an_unknown_host_is_refused() -> None:
    with pytest.raises(
        BadInputError, match=r"expected a host name or IPv4 address, found 'no\.such"
    ):
        open_tcp_link(Address("no.such.invalid", 1))


@given(cuts=st.lists(st.integers(0, 320), max_size=12))
def test_frames_are_found_however_the_stream_is_cut(cuts: list[int]) -> None:
    stream_bytes = b"".join(sample.pack() for sample in SAMPLES[:10])
    with open_listener() as listening, socket.create_connection(listening.getsockname()) as sender:
        stream = Stream(listening.accept()[0], SAMPLE.size)
        samples = []
        edges = [0, *sorted(cuts), len(stream_bytes)]
        for begin, end in pairwise(edges):
            sender.sendall(stream_bytes[begin:end])
            while (came := stream.take_frame()) is not None:
                samples.append(Sample.unpack(came[0]))
        stream.close()
    assert samples == SAMPLES[:10]


@pytest.fixture
def server() -> Iterator[tuple[TcpServer, Address]]:
    with open_listener() as probe:
        address = Address(*probe.getsockname())
    with TcpServer(address, COMMAND.size, Command.unpack) as made:
        yield made, address


def command(server: TcpServer) -> Command | None:
    return server.receive(time.monotonic() + LONG_S)


def test_a_second_connection_is_turned_away_and_the_next_is_taken(
    server: tuple[TcpServer, Address],
) -> None:
    rig, address = server
    where = (address.host, address.port)
    rig.send(SAMPLES[0].pack())  # to nobody
    with socket.create_connection(where) as first:
        first.sendall(Command(0.1).pack() + COMMAND.pack(0.1, 0.5))
        assert command(rig) == Command(0.1)
        with socket.create_connection(where) as second:
            assert rig.receive(time.monotonic() + 0.05) is None
            second.settimeout(LONG_S)
            assert second.recv(1) == b""
        assert (rig.foreign, rig.malformed) == (1, 1)
        rig.send(SAMPLES[1].pack())
        assert first.recv(64) == SAMPLES[1].pack()
    with socket.create_connection(
        where
    ) as third:  # comes before anybody has noticed that the first has gone
        third.sendall(Command(0.2).pack())
        assert command(rig) == Command(0.2)
    assert rig.foreign == 1


def test_an_address_in_use_is_one_sentence(server: tuple[TcpServer, Address]) -> None:
    with pytest.raises(
        BadInputError,
        match=f"cannot listen on {server[1]}: Address already in use; choose another",
    ):
        TcpServer(server[1], COMMAND.size, Command.unpack)


@pytest.fixture
def emulator() -> Iterator[Emulator]:
    made = Emulator("--lockstep", tcp=True)
    yield made
    made.kill()


def test_the_emulator_over_tcp_outlives_a_connection_and_holds_its_last_command(
    emulator: Emulator,
) -> None:
    assert "answers there over TCP, in lockstep" in emulator.ready
    assert emulator.link.receive(time.monotonic() + 0.5) is None  # connects
    moved = [emulator.link.exchange(Command(0.3), LONG_S) for _ in range(10)]
    assert moved[-1].cart_m > moved[0].cart_m > 0
    emulator.link.close()
    again = open_tcp_link(emulator.rig)
    sample = again.exchange(Command(0.0), LONG_S)
    assert sample.cart_m > moved[-1].cart_m
    again.close()
    assert "11 samples sent, 11 commands taken, 0 malformed and 0 foreign" in emulator.end()


@pytest.mark.wall_time
def test_the_emulator_sends_over_tcp_in_real_time() -> None:
    emulator = Emulator("--rate", "100", tcp=True)
    try:
        emulator.receive()
        begin = time.monotonic()
        for _ in range(50):
            emulator.receive()
            emulator.link.send(Command(0.1))
        assert time.monotonic() - begin == pytest.approx(0.5, abs=0.3)
        assert emulator.receive().cart_m > 0
    finally:
        emulator.kill()

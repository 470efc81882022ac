"""Cases of a fuzzer: files as damage, other programs and mischief leave them, and a command.

A case is right when the command ends with status 0, 1 or 2, says one sentence where it did not
answer, and neither a traceback nor an internal error.
"""

import contextlib
import functools
import io
import json
import math
import signal
import struct
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from hypothesis import strategies as st
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pendulum_sysid.cli import main
from support.made_recordings import INTECO, ROOT, made

STORE = get_typestore(Stores.ROS2_JAZZY)
STATE, NUMBER = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
SECONDS = 3.0
TWIN_TEXT = (ROOT / "config" / "inteco.yaml").read_text()
LONGEST_S = 10  # that a command may take, beside a diagnosis that answers
Files = dict[str, bytes]


@dataclass(frozen=True)
class Case:
    """Hold one case.

    kind: of what was fuzzed.
    files: name -> content, in the folder in which the command runs.
    argv: of the command; names of files stand as {name}.
    """

    kind: str
    files: Files
    argv: tuple[str, ...]

    def __repr__(self) -> str:  # what Hypothesis prints of a failure
        sizes = {name: len(content) for name, content in self.files.items()}
        return f"Case({self.kind}, {sizes}, {self.argv})"


@dataclass(frozen=True)
class Result:
    """Hold how a command ended.

    status: its exit status.
    said: what it printed on stderr.
    seconds: wall time.
    """

    status: int
    said: str
    seconds: float


class Hung(BaseException):
    """Say that a command did not end; no `except Exception` of the command catches it."""


def run_case(case: Case) -> Result:
    """Run the command of a case in a folder of its own, in this process."""
    with tempfile.TemporaryDirectory() as folder:
        for name, content in case.files.items():
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        argv = [word.replace("{}", folder) for word in case.argv]
        out, said = io.StringIO(), io.StringIO()
        began = time.monotonic()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(said), _limit():
            try:
                status = main(argv)
            except SystemExit as ending:
                status = int(ending.code or 0)
        return Result(status, said.getvalue(), time.monotonic() - began)


@contextlib.contextmanager
def _limit() -> Iterator[None]:
    """Raise Hung when the body takes far longer than any command may."""

    def stop(number: int, frame: Any) -> None:
        raise Hung(f"the command was still running after {6 * LONGEST_S} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.alarm(6 * LONGEST_S)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def list_faults(result: Result) -> list[str]:
    """Return what is wrong with how a command ended; none when it is right."""
    faults = []
    if result.status not in (0, 1, 2):
        faults.append(f"it ended with status {result.status}")
    for word in ("internal error", "Traceback"):
        if word in result.said:
            faults.append(f"it said {result.said[-300:]!r}")
    lines = [line for line in result.said.splitlines() if line.startswith("sysid: ")]
    if result.status == 1 and len(lines) != 1:
        faults.append(f"it did not answer, and said {result.said[-300:]!r}")
    return faults


# What is fuzzed begins as something good.


@functools.cache
def make_bag(plugin: StoragePlugin, packed: CompressionMode) -> Files:
    """Return the files of a good bag of 3 s."""
    return write_messages(*_list_good_messages(), plugin=plugin, packed=packed)


@functools.cache
def _list_good_messages() -> tuple[list[tuple[int, bytes]], list[tuple[int, bytes]]]:
    signals = made(INTECO, SECONDS).signals
    times = 10**18 + np.arange(len(signals)) * 10_000_000
    assert signals.cart is not None and signals.pole is not None
    states = [
        (int(t), encode_state(int(t), ["cart", "pole"], [x, th]))
        for t, x, th in zip(times, signals.cart, signals.pole, strict=True)
    ]
    commands = [(int(t), encode_number(u)) for t, u in zip(times, signals.command, strict=True)]
    return states, commands


def encode_state(stamp_ns: int, names: list[str], positions: list[float]) -> bytes:
    second, rest = divmod(stamp_ns, 10**9)
    time_of = STORE.types["builtin_interfaces/msg/Time"](sec=second, nanosec=rest)
    header = STORE.types["std_msgs/msg/Header"](stamp=time_of, frame_id="")
    nothing = np.empty(0)
    message = STORE.types[STATE](header, names, np.array(positions, float), nothing, nothing)
    return bytes(STORE.serialize_cdr(message, STATE))


def encode_number(value: float) -> bytes:
    return bytes(STORE.serialize_cdr(STORE.types[NUMBER](data=value), NUMBER))


def write_messages(
    states: list[tuple[int, bytes]],
    commands: list[tuple[int, bytes]],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    packed: CompressionMode = CompressionMode.NONE,
) -> Files:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        writer = Writer(path, version=9, storage_plugin=plugin)
        if packed is not CompressionMode.NONE:
            writer.set_compression(packed, CompressionFormat.ZSTD)
        with writer:
            ours = writer.add_connection("/rig/joint_states", STATE, typestore=STORE)
            theirs = writer.add_connection("/rig/pwm", NUMBER, typestore=STORE)
            both = [(t, ours, m) for t, m in states] + [(t, theirs, m) for t, m in commands]
            for at, connection, message in sorted(both, key=lambda entry: entry[0]):
                writer.write(connection, at, message)
        return {f"bag/{file.name}": file.read_bytes() for file in path.iterdir()}


# Strategies: what may be wrong with a file.

ODD_NUMBERS = st.sampled_from(
    [0.0, -1.0, 1e-300, 1e300, math.nan, math.inf, -math.inf, 2**31, 2**63, -(2**63), 1e9]
)
ODD_VALUES: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    ODD_NUMBERS,
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["0x10", "1:30", "2026-13-45", "1e999", "[" * 5000, "5e-05", ".nan", "~"]),
    st.lists(st.integers(), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=3),
)
BOMB = b"a: &a [x,x,x,x,x,x,x,x,x]\n" + b"".join(
    b"%c: &%c [%s]\n" % (98 + k, 98 + k, b",".join([b"*%c" % (97 + k)] * 9)) for k in range(9)
)
PACKED_ZEROS = zstandard.ZstdCompressor().compress(bytes(1 << 28))


@st.composite
def damage(draw: st.DrawFn, content: bytes) -> bytes:
    """Flip, cut, repeat or insert bytes, at places anywhere in the content."""
    data = bytearray(content)
    for _ in range(draw(st.integers(1, 6))):
        how = draw(st.sampled_from(["flip", "flip", "flip", "cut", "repeat", "insert", "number"]))
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        if not data:
            break
        if how == "flip":
            data[at] ^= 1 << draw(st.integers(0, 7))
        elif how == "cut":
            del data[at : at + draw(st.sampled_from([1, 8, 100, 10**9]))]
        elif how == "repeat":
            data[at:at] = data[at : at + draw(st.sampled_from([8, 300]))]
        elif how == "insert":
            data[at:at] = draw(st.binary(min_size=1, max_size=12))
        else:
            data[at : at + 8] = struct.pack("<Q", draw(st.sampled_from([0, 2**32, 2**63 - 1])))
    return bytes(data)


@st.composite
def damaged_bags(draw: st.DrawFn) -> Case:
    plugin = draw(st.sampled_from([StoragePlugin.MCAP, StoragePlugin.SQLITE3]))
    packed = draw(st.sampled_from(list(CompressionMode)))
    if plugin is StoragePlugin.SQLITE3 and packed is CompressionMode.STORAGE:
        packed = CompressionMode.FILE
    files = dict(make_bag(plugin, packed))
    name = draw(st.sampled_from(sorted(files)))
    what = draw(st.sampled_from(["damage", "damage", "damage", "remove", "empty", "bomb", "swap"]))
    if what == "damage":
        files[name] = draw(damage(files[name]))
    elif what == "remove":
        del files[name]
    elif what == "empty":
        files[name] = b""
    elif what == "bomb":
        files["bag/metadata.yaml"] = BOMB
    else:
        files["bag/bomb.mcap.zstd"] = PACKED_ZEROS
        files.pop("bag/metadata.yaml", None)
    return _with_recording(draw, f"{plugin.name.lower()} bag", files)


@st.composite
def indexed_bags(draw: st.DrawFn) -> Case:
    """A good bag beside an index with odd values in it."""
    files = dict(make_bag(StoragePlugin.MCAP, CompressionMode.NONE))
    index: dict[str, Any] = {
        "version": draw(ODD_VALUES),
        "storage_identifier": draw(st.one_of(st.just("mcap"), ODD_VALUES)),
        "relative_file_paths": draw(
            st.one_of(ODD_VALUES, st.lists(ODD_VALUES, max_size=3), st.just(["bag.mcap"]))
        ),
        "starting_time": draw(ODD_VALUES),
        "topics_with_message_count": draw(
            st.one_of(
                ODD_VALUES,
                st.lists(
                    st.fixed_dictionaries(
                        {
                            "topic_metadata": st.one_of(
                                ODD_VALUES, st.fixed_dictionaries({"name": ODD_VALUES})
                            ),
                            "message_count": ODD_VALUES,
                        }
                    ),
                    max_size=3,
                ),
            )
        ),
        "compression_mode": draw(st.one_of(st.just("MESSAGE"), ODD_VALUES)),
    }
    whole = draw(st.one_of(st.just({"rosbag2_bagfile_information": index}), ODD_VALUES))
    files["bag/metadata.yaml"] = json.dumps(whole).encode("utf-8", "surrogatepass")
    return _with_recording(draw, "index", files)


@st.composite
def odd_bags(draw: st.DrawFn) -> Case:
    """A bag whose messages are well formed and whose content is odd."""
    count = draw(st.sampled_from([0, 1, 2, 99, 120, 300]))
    step_ns = draw(st.sampled_from([0, 1, 10_000, 10_000_000, 10**9, 3600 * 10**9]))
    begin = draw(st.sampled_from([0, 10**18, (2**31 - 2) * 10**9, -(2**31) * 10**9]))
    names = draw(
        st.sampled_from([["cart", "pole"], ["pole"], ["cart"], ["cart", "cart"], [], ["x", "y"]])
    )
    drawn = np.random.default_rng(draw(st.integers(0, 2**32)))
    scale = draw(st.sampled_from([0.0, 1e-3, 1e3, 1e300]))
    values = np.cumsum(drawn.normal(0.0, scale, (count, 2)), 0)
    if draw(st.booleans()):
        signals = made(INTECO, SECONDS).signals
        assert signals.cart is not None and signals.pole is not None
        values = np.column_stack([signals.cart, signals.pole])[:count]
    for _ in range(draw(st.integers(0, 4)) if count else 0):
        values[draw(st.integers(0, count - 1)), draw(st.integers(0, 1))] = draw(ODD_NUMBERS)
    stamps = [
        min(max(begin + k * step_ns, -(2**31) * 10**9), (2**31 - 1) * 10**9) for k in range(count)
    ]
    if count and draw(st.booleans()):
        stamps[draw(st.integers(0, count - 1))] = draw(st.sampled_from([0, 10**18, -1]))
    received = [10**18 + k * max(step_ns, 1) for k in range(count)]
    states = [
        (at, encode_state(stamp, names, list(row)[: len(names)]))
        for at, stamp, row in zip(received, stamps, values, strict=True)
    ]
    commands = [
        (at, encode_number(u))
        for at, u in zip(received, drawn.normal(0.0, 0.1, count), strict=True)
    ]
    commands = commands[: draw(st.sampled_from([0, 1, 150, 300]))]
    return _with_recording(draw, "content", write_messages(states, commands))


@st.composite
def twins(draw: st.DrawFn) -> Case:
    lines = TWIN_TEXT.splitlines()
    how = draw(st.sampled_from(["value", "value", "key", "line", "bytes", "bomb", "nest"]))
    at = draw(st.integers(0, len(lines) - 1))
    if how == "value":
        lines[at] = f"{lines[at].partition(':')[0]}: {draw(ODD_VALUES)}"
    elif how == "key":
        lines.insert(at, f"  {draw(st.text(max_size=12))}: 1.0")
    elif how == "line":
        lines[at : at + 1] = draw(st.lists(st.just(lines[at]), max_size=2))
    content = "\n".join(lines).encode("utf-8", "surrogatepass")
    if how == "bytes":
        content = draw(damage(content))
    elif how == "bomb":
        content = BOMB
    elif how == "nest":
        content = b"rig: " + b"[" * 5000
    files = {**make_bag(StoragePlugin.MCAP, CompressionMode.NONE), "twin.yaml": content}
    verb = draw(st.sampled_from(["check", "replay"]))
    return Case("twin", files, (verb, "{}/bag", "--twin", "{}/twin.yaml"))


@st.composite
def tables(draw: st.DrawFn) -> Case:
    separator = draw(st.sampled_from([",", ";", "\t", " ", ",,"]))
    rows = draw(st.sampled_from([0, 1, 3, 150]))
    begin = draw(st.sampled_from([0.0, 1.7e9, 1.7e12, 1.7e18, -5.0, 1e300]))
    step = draw(st.sampled_from([0.01, 10.0, 1e7, 3600.0, 0.0]))
    lines = [separator.join(["t", "u", "x", "th"])] if draw(st.booleans()) else []
    for k in range(rows):
        row = [repr(begin + k * step), "0.1", repr(math.sin(k / 9)), repr(3 + math.cos(k / 9))]
        lines.append(separator.join(row))
    for _ in range(draw(st.integers(0, 3)) if lines else 0):
        at = draw(st.integers(0, len(lines) - 1))
        lines[at] = draw(st.one_of(st.text(max_size=30), st.just(lines[at] + separator + "9")))
    content = "\n".join(lines).encode("utf-8", "surrogatepass")
    if draw(st.booleans()):
        content = draw(damage(content))
    suffix = draw(st.sampled_from(["csv", "csv", "txt", "mat", "npz", "parquet"]))
    names = draw(st.sampled_from([("t", "u", "x", "th"), ("1", "2", "3", "4")]))
    columns = zip(("--time", "--command", "--cart", "--pole"), names, strict=True)
    argv = ["import", f"{{}}/log.{suffix}", "--out", "{}/bag"]
    argv += [word for pair in columns for word in pair]
    return Case("table", {f"log.{suffix}": content}, tuple(argv))


@st.composite
def verdicts(draw: st.DrawFn) -> Case:
    """An earlier verdict, wrong in places, beside its twin: `next` refuses or plans."""
    entry = st.fixed_dictionaries(
        {"effect": ODD_VALUES, "cannot_be_told_from": st.one_of(ODD_VALUES, st.just([]))}
    )
    content = {
        "schema": draw(st.one_of(st.just("pendulum_verdict/1"), ODD_VALUES)),
        "outcome": draw(st.one_of(st.just("unusable"), ODD_VALUES)),
        "missing_physics": draw(st.one_of(ODD_VALUES, st.lists(entry, min_size=1, max_size=2))),
    }
    text = json.dumps(content).encode("utf-8", "surrogatepass")
    if draw(st.booleans()):
        text = draw(damage(text))
    files = {"verdict.json": text, "twin.yaml": draw(st.sampled_from([b"", b"schema: x", b"{"]))}
    files |= make_bag(StoragePlugin.MCAP, CompressionMode.NONE)
    argv = ("next", "{}/bag", "--twin", "{}/twin.yaml", "--verdict", "{}/verdict.json")
    return Case("verdict", files, (*argv, "--out", "{}/plan.yaml"))


def _with_recording(draw: st.DrawFn, kind: str, files: Files) -> Case:
    verb = draw(st.sampled_from(["check", "check", "replay"]))
    files["twin.yaml"] = TWIN_TEXT.encode()
    return Case(kind, files, (verb, "{}/bag", "--twin", "{}/twin.yaml"))


CASES: st.SearchStrategy[Case] = st.one_of(
    damaged_bags(), damaged_bags(), indexed_bags(), odd_bags(), twins(), tables(), verdicts()
)

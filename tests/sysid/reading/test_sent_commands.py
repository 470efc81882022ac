"""A recording of chosen commands says so where the driver sent other commands."""

import re
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.reading.bag import COMMAND_TYPE, STATE_TYPE, read_bag
from pendulum_sysid.reading.sent_commands import find_differences, name_sent_topic
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats

PERIOD_NS, COUNT = 10_000_000, 1000
TIMES_NS = 1_700_000_000_000_000_000 + PERIOD_NS * np.arange(COUNT)
CHOSEN = 0.6 * np.sin(0.05 * np.arange(COUNT))
LIMIT = 0.5
STORE = get_typestore(Stores.ROS2_JAZZY)


def record(path: Path, sent: Floats, late_ns: int = 400_000, name: str = "applied_pwm") -> Path:
    """Write a bag in which the driver says what it sent, so much after each command."""
    state_of, header_of, time_of, float_of = (
        STORE.types[kind]
        for kind in (
            STATE_TYPE,
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
            COMMAND_TYPE,
        )
    )
    messages = []
    for k, now in enumerate(TIMES_NS.tolist()):
        header = header_of(time_of(*divmod(now, 10**9)), "")
        places = np.array([0.1 * np.sin(0.05 * k), 3.0 + 0.1 * np.cos(0.05 * k)])
        sample = state_of(header, ["cart", "pole"], places, np.empty(0), np.empty(0))
        messages += [
            (now, "/rig/joint_states", STORE.serialize_cdr(sample, STATE_TYPE)),
            (now, "/rig/pwm", STORE.serialize_cdr(float_of(CHOSEN[k]), COMMAND_TYPE)),
            (now + late_ns, f"/rig/{name}", STORE.serialize_cdr(float_of(sent[k]), COMMAND_TYPE)),
        ]
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {
            topic: writer.add_connection(topic, kind, typestore=STORE)
            for topic, kind in (
                ("/rig/joint_states", STATE_TYPE),
                ("/rig/pwm", COMMAND_TYPE),
                (f"/rig/{name}", COMMAND_TYPE),
            )
        }
        for time, topic, data in sorted(messages):
            writer.write(topics[topic], time, data)
    return path


def list_notes(recording: Recording) -> list[str]:
    return [f.note for f in recording.findings if f.kind == "other_command"]


def test_a_limit_of_the_driver_is_said(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", np.clip(CHOSEN, -LIMIT, LIMIT))
    recording = clean_recording(read_bag(path))
    (note,) = list_notes(recording)
    share = re.fullmatch(
        r"the driver sent other commands \(/rig/applied_pwm\) than /rig/pwm holds in (\d+)% of "
        r"the samples: use --command-topic /rig/applied_pwm",
        note,
    )
    assert share, note
    assert int(share[1]) / 100 == pytest.approx(np.mean(np.abs(CHOSEN) > LIMIT + 0.01), abs=0.04)
    finding = next(f for f in recording.findings if f.kind == "other_command")
    first_s, last_s = finding.intervals_s[0]
    np.testing.assert_allclose([first_s, last_s], [0.2, 9.9], atol=0.2)
    assert finding.count == len(finding.intervals_s) == 1  # each less than 0.5 s from the next


def test_commands_of_a_driver_that_comes_late_are_others(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", CHOSEN, late_ns=25_000_000)
    assert list_notes(clean_recording(read_bag(path)))


def test_the_same_commands_are_no_others(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", CHOSEN, late_ns=3_000_000)
    assert read_bag(path).sent is None
    sent = record(tmp_path / "limited", np.clip(CHOSEN, -LIMIT, LIMIT))
    assert read_bag(sent, command_topic="/rig/applied_pwm").sent is None


def test_a_topic_of_another_name_says_nothing(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", np.clip(CHOSEN, -LIMIT, LIMIT), name="other")
    assert read_bag(path).sent is None


def test_fast_commands_that_cross_with_samples_are_no_others() -> None:
    stamps = 0.01 * np.arange(1000)
    times = 0.001 * np.arange(10_000)
    read = np.sin(2 * np.pi * 20.0 * times)
    assert not find_differences(stamps, (times, read), (times + 0.0004, read)).any()
    fine, late = 0.001 * np.arange(10_000), 0.003
    slow = 0.01 * np.arange(1000)
    steps = np.sin(slow)
    assert not find_differences(fine, (slow, steps), (slow + late, steps)).any()
    limited = np.clip(read, -LIMIT, LIMIT)
    assert np.mean(find_differences(stamps, (times, read), (times + 0.0004, limited))) > 0.1


def test_a_driver_beside_a_topic_without_namespace_is_found() -> None:
    names = [name_sent_topic(topic) for topic in ("/rig/pwm", "/pwm", "pwm")]
    assert names == ["/rig/applied_pwm", "/applied_pwm", "applied_pwm"]

"""What a browser gets: the latest messages as strict JSON, and the points of the last seconds."""

import asyncio
import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.view.board import NODES_KEPT, SAMPLES_KEPT, Board
from pendulum_bridge.view.feed import HISTORY_S, RATE_HZ, Feed, keep_ticking
from pendulum_bridge.view.frame import COLUMNS, make_frame, make_point
from pendulum_bridge.view.samples import NodeHealth, Sample, Word

PERIOD_NS = 10_000_000
ANY_FLOAT = st.floats(allow_nan=True, allow_infinity=True)


def sample(
    k: int, heard_s: float, cart_m: float | None = 0.1, pole_rad: float | None = 3.0
) -> Sample:
    return Sample(k * PERIOD_NS, heard_s, 0.004, cart_m, pole_rad, 0.0, 0.0)


def board_with(count: int = 5, now_s: float = 10.0) -> Board:
    board = Board("/rig", "/twin")
    for k in range(count):
        board.take_sample("rig", sample(k, now_s, cart_m=0.3))
        board.take_sample("twin", sample(k, now_s, cart_m=0.1))
    return board


def strict(moment: Any) -> Any:
    return json.loads(json.dumps(moment, allow_nan=False))


def test_a_frame_holds_both_and_their_mismatch() -> None:
    board = board_with()
    board.take_pwm("rig", Word(0.2, 10.0))
    board.take_applied("rig", Word(0.15, 10.0))
    board.take_stopped("rig", True)
    moment = strict(make_frame(board.take_snapshot(10.1)))
    rig = moment["rig"]
    assert (rig["namespace"], rig["state"], rig["notice"]) == ("/rig", "fresh", None)
    assert (rig["cart_m"], rig["pwm"], rig["applied_pwm"], rig["stopped"]) == (
        0.3,
        0.2,
        0.15,
        True,
    )
    assert rig["rate_hz"] == pytest.approx(100) and rig["stamp_age_s"] == pytest.approx(0.104)
    assert moment["mismatch"]["cart_m"] == pytest.approx(0.2)
    assert dict(zip(COLUMNS, make_point(moment), strict=True)) == {
        "time_s": 10.1, "rig_cart_m": 0.3, "rig_pole_rad": 3.0,
        "rig_pwm": 0.2, "rig_applied_pwm": 0.15,
        "twin_cart_m": 0.1, "twin_pole_rad": 3.0, "twin_pwm": None, "twin_applied_pwm": None,
        "mismatch_cart_m": 0.2, "mismatch_pole_rad": 0.0,
    }  # fmt: skip


def test_silence_is_told_after_half_a_second_and_nothing_old_is_plotted() -> None:
    board = board_with(now_s=10.0)
    board.take_applied("twin", Word(0.3, 10.0))
    assert make_frame(board.take_snapshot(10.5))["twin"]["state"] == "fresh"
    moment = make_frame(board.take_snapshot(10.51))
    assert moment["twin"]["state"] == "stale" and moment["mismatch"] is None
    assert moment["twin"]["notice"] == "/twin is silent: its last sample is shown."
    assert moment["twin"]["cart_m"] == 0.1 and moment["twin"]["applied_pwm"] is None
    assert make_point(moment)[1:] == [None] * (len(COLUMNS) - 1)


def test_who_was_never_heard_is_waited_for_and_who_is_not_there_is_left_out() -> None:
    moment = make_frame(Board("/lab/rig", None).take_snapshot(0.0))
    assert moment["rig"]["state"] == "never" and moment["twin"] is None
    assert (
        moment["rig"]["notice"] == "No sample of /lab/rig yet: waiting for /lab/rig/joint_states."
    )
    assert len(make_point(moment)) == len(COLUMNS)


def test_refused_messages_are_counted_and_told_once_nothing_good_comes() -> None:
    board = Board("/rig", "/twin")
    for _ in range(3):
        board.refuse("rig", "expected finite numbers, found nan")
    rig = make_frame(board.take_snapshot(0.0))["rig"]
    assert rig["refused"] == 3 and rig["notice"].endswith(
        "Refused: expected finite numbers, found nan."
    )


@given(st.lists(ANY_FLOAT, min_size=8, max_size=8), st.floats(0, 1e6))
def test_whatever_is_heard_the_frame_is_strict_json(values: list[float], now_s: float) -> None:
    board = Board("/rig", "/twin")
    for k in range(3):
        board.take_sample("rig", Sample(k * PERIOD_NS, 0.0, *values[:5]))
        board.take_sample("twin", Sample(k * PERIOD_NS, 0.0, *values[3:]))
    board.take_pwm("rig", Word(values[0], 0.0))
    moment = make_frame(board.take_snapshot(now_s))
    strict(moment)
    assert all(value is None or math.isfinite(value) for value in make_point(moment))


def test_a_stamp_that_goes_back_begins_anew_and_samples_are_bounded() -> None:
    board = board_with(SAMPLES_KEPT + 50)
    snapshot = board.take_snapshot(10.0)
    assert snapshot.rig is not None and len(snapshot.rig.samples) == SAMPLES_KEPT
    board.take_sample("rig", sample(3, 10.0))
    after = board.take_snapshot(10.0)
    assert after.rig is not None and [s.stamp_ns for s in after.rig.samples] == [3 * PERIOD_NS]
    assert len(snapshot.rig.samples) == SAMPLES_KEPT  # what was handed over stays as it was


def said(name: str, level: int, heard_s: float) -> NodeHealth:
    return NodeHealth(name, level, "drives the rig", heard_s, {"sent": "3"})


def test_nodes_are_listed_by_name_go_stale_and_are_forgotten() -> None:
    board = Board("/rig", "/twin")
    for name, level, heard_s in (
        ("/b", 1, 99.0),
        ("/a", 0, 50.0),
        ("/c", 7, 99.0),
        ("/old", 2, 1.0),
    ):
        board.take_health(said(name, level, heard_s))
    nodes = {node["name"]: node for node in make_frame(board.take_snapshot(100.0))["nodes"]}
    assert list(nodes) == ["/a", "/b", "/c"]
    assert [node["level"] for node in nodes.values()] == ["stale", "warn", "stale"]
    assert nodes["/a"]["sentence"] == "silent; it said last: drives the rig" and nodes["/b"][
        "figures"
    ] == {"sent": "3"}


def test_a_flood_of_nodes_is_bounded() -> None:
    board = Board("/rig", "/twin")
    for k in range(5 * NODES_KEPT):
        board.take_health(said(f"/n{k}", 0, float(k) / 100))
    assert len(board.take_snapshot(2.0).nodes) == NODES_KEPT


def feed_of(board: Board, ticks: int) -> Feed:
    feed = Feed(board.take_snapshot, {"rail_half_length_m": 0.9})
    for k in range(ticks):
        feed.tick(k / RATE_HZ)
    return feed


def test_a_reader_gets_the_newest_frame_and_the_points_it_missed() -> None:
    feed = feed_of(board_with(), 10)
    got = json.loads(feed.write_text(6))
    assert (
        got["number"] == 9
        and got["time_s"] == pytest.approx(9 / RATE_HZ, rel=1e-6)
        and got["rail_half_length_m"] == 0.9
    )
    assert [p[0] for p in got["points"]] == pytest.approx(
        [7 / RATE_HZ, 8 / RATE_HZ, 9 / RATE_HZ], rel=1e-6
    )
    assert json.loads(feed.write_text(9))["points"] == []
    assert (
        len(json.loads(feed.write_text(-1))["points"])
        == len(json.loads(feed.write_text(10**9))["points"])
        == 10
    )


def test_the_history_is_bounded_however_long_a_reader_waits() -> None:
    feed = feed_of(board_with(), 2000)
    points = json.loads(feed.write_text(3))["points"]
    assert len(points) == round(HISTORY_S * RATE_HZ) and points[-1][0] == pytest.approx(
        1999 / RATE_HZ, rel=1e-6
    )


def test_a_tick_that_fails_is_complained_of_and_followed_by_others() -> None:
    complaints: list[str] = []
    board = board_with()

    def look(now_s: float) -> Any:
        if not complaints:
            raise ValueError("broken")
        return board.take_snapshot(now_s)

    async def first_frame() -> int:
        feed = Feed(look)
        task = asyncio.create_task(keep_ticking(feed, lambda: 0.0, complaints.append))
        await asyncio.wait_for(feed.wait_for_newer(-1), 30)
        task.cancel()
        return feed.number

    assert asyncio.run(first_frame()) == 0
    assert complaints == ["no frame: ValueError('broken')"]

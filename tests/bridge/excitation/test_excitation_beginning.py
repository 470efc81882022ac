"""A plan begins with the cart near the middle of the rail, over real topics, on a tilted rail.

The first push of a plan shows the direction of the cart, and needs room to both sides. A cart on
a tilted rail rolls off after a reset, the further the longer the plan takes to begin.
"""

from functools import partial
from pathlib import Path

import pytest

rclpy = pytest.importorskip("rclpy")
from support.excitation_bench import TWIN, Bench, written  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_bridge.excitation import run  # noqa: E402
from pendulum_bridge.excitation.guard import StopReason  # noqa: E402
from pendulum_bridge.excitation.push import Push as SentPush  # noqa: E402
from pendulum_bridge.excitation.run import MOST_RESETS  # noqa: E402
from pendulum_bridge.nodes.pendulum_client import PendulumClient  # noqa: E402
from pendulum_bridge.nodes.reset_sequence import ResetSequence  # noqa: E402
from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402
from pendulum_twin.plans.excitation import Excitation  # noqa: E402
from pendulum_twin.plans.plan_phases import Push, Rest  # noqa: E402

STEEP_RAD = 0.15  # the cart rolls 0.6 m in a second
# the cart rolls 0.5 m in 2.3 s and 0.16 m while PLAYED is played, so that a plan that begins in
# time ends in time on a computer that stands still for a second
GENTLE_RAD = 0.03
NEAR_M = 0.45
AWAY_M = 0.5
PLAYED = (Push(seconds=0.9), Rest(seconds=0.1))


@pytest.fixture
def planned(tmp_path):
    """Return what writes a plan file of phases and returns its path."""
    return partial(written, tmp_path)


def make_tilted(file: Path, angle_rad: float) -> Path:
    """Write the file of a rig whose rail is tilted, and return its path."""
    save_twin(Twin("tilted", load_twin(TWIN).rig, {"rail_tilt": {"angle_rad": angle_rad}}), file)
    return file


@pytest.fixture
def gentle(tmp_path) -> Path:
    """Return the file of a rig that plays a plan to its end after a reset, and then rolls off."""
    return make_tilted(tmp_path / "gentle.yaml", GENTLE_RAD)


@pytest.fixture
def steep(tmp_path) -> Path:
    """Return the file of a rig that rolls off at once."""
    return make_tilted(tmp_path / "steep.yaml", STEEP_RAD)


@pytest.fixture
def resets(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the list of the namespaces that are reset, in their order.

    On a busy computer the first push may be uneven; then the plan begins again, with new resets.
    """
    reset, namespaces = PendulumClient.reset, []
    monkeypatch.setattr(
        PendulumClient,
        "reset",
        lambda client: namespaces.append(client.namespace) or reset(client),
    )
    return namespaces


def is_away(bench: Bench) -> bool:
    """Return whether the cart is away from the middle, by the rig itself: samples may wait."""
    return abs(bench.rig._live.state[0]) > AWAY_M


def notice_late(patch: pytest.MonkeyPatch, bench: Bench, count: int) -> None:
    """Let the node notice the end of the first count resets when the cart has rolled off."""
    notice, ended = ResetSequence.done, set()

    def notice_later(resets: ResetSequence, now_s: float) -> bool:
        if not notice(resets, now_s):
            return False
        ended.add(resets)
        return len(ended) > count or is_away(bench)

    patch.setattr(ResetSequence, "done", notice_later)


def roll_off(bench: Bench) -> None:
    """Wait until the cart of a tilted rail is away from the middle."""
    bench.ros.until(lambda: is_away(bench), "a cart that rolls off")


def test_a_cart_that_rolls_off_before_the_plan_begins_is_reset_again(
    ros: Graph, planned, gentle, resets, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(ros, gentle)
    notice_late(monkeypatch, bench, 1)
    node = bench.play(planned(*PLAYED))
    assert bench.over(node) is None
    assert resets.count("/rig") > 1 + node._run.pushes
    assert abs(node._run.performance.playback.start_m) < NEAR_M


def test_a_cart_that_no_reset_holds_ends_the_run_with_what_to_do(
    ros: Graph, planned, steep, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(ros, steep)
    notice_late(monkeypatch, bench, MOST_RESETS)
    node = bench.play(planned(*PLAYED))
    assert bench.over(node) is StopReason.CART_AWAY
    assert node.end().startswith(
        "The cart is away from the middle of the rail when the plan should begin (expected at "
        "most 0.45 m, found 0."
    )
    assert node.end().endswith(
        f" m, after {MOST_RESETS} resets: level the rail, or see why the cart does not stay where "
        "a reset leaves it)."
    )
    assert set(bench.sent["/rig"]) == {0.0}


def test_a_rig_that_may_not_be_reset_has_to_stand_near_the_middle(
    ros: Graph, planned, gentle
) -> None:
    bench = Bench(ros, gentle)
    roll_off(bench)
    node = bench.play(planned(*PLAYED), reset_first=False)
    assert bench.over(node) is StopReason.CART_AWAY
    assert node.end().endswith(
        " m: move it to the middle, or let it be reset: reset_first:=true)."
    )
    assert set(bench.sent["/rig"]) == {0.0}


def test_a_cart_that_is_away_can_be_reset_where_others_are_not(
    ros: Graph, planned, gentle, resets
) -> None:
    bench = Bench(ros, gentle)
    roll_off(bench)
    node = bench.play(planned(*PLAYED), reset_first=False, reset_when_away=True)
    assert bench.over(node) is None and resets[:2] == ["/twin", "/rig"]
    assert abs(node._run.performance.playback.start_m) < NEAR_M


def test_a_cart_near_the_middle_is_not_reset_when_only_others_are(
    ros: Graph, planned, resets
) -> None:
    bench = Bench(ros)
    node = bench.play(planned(*PLAYED), reset_first=False, reset_when_away=True)
    assert bench.over(node) is None and resets == ["/twin", "/rig"] * node._run.pushes


def test_an_uneven_push_is_followed_by_a_reset(
    ros: Graph, planned, resets, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The push has moved the cart: on a tilted rail the cart rolls on while the rate is seen."""
    judge, judged = run.is_even, []

    def judge_later(push: SentPush, plan: Excitation) -> bool:
        judged.append(push)
        return len(judged) > 1 and judge(push, plan)

    monkeypatch.setattr(run, "is_even", judge_later)
    bench = Bench(ros)
    longer = planned(*PLAYED, Rest(seconds=2.0))  # than this computer may stand still in a push
    node = bench.play(longer, reset_first=False, reset_when_away=True)
    assert bench.over(node) is None
    assert node._run.pushes >= 1 and resets == ["/twin", "/rig"] * node._run.pushes


def test_the_rig_is_reset_last_as_it_may_roll_while_the_twin_is_reset(
    ros: Graph, planned, resets
) -> None:
    bench = Bench(ros)
    node = bench.play(planned(*PLAYED))
    assert bench.over(node) is None
    assert resets == ["/twin", "/rig"] * (1 + node._run.pushes)

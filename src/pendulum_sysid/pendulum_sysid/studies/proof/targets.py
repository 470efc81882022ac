"""What a proof has to show, and whether it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import WITHIN, Quantiles
from pendulum_sysid.telling.tables import NOTHING, number

RIGHT = {"single": 0.98, "pair": 0.95, "triple": 0.90}
WORDS = {
    "single": "one effect: named right",
    "pair": "two effects: named right",
    "triple": "three effects: named right",
}


@dataclass(frozen=True)
class Target:
    """Hold one thing to show: what, the figure found, its 95 % interval or other figures beside it, the mark, if it is met.

    share: the counts behind the figure, None for a figure that is no share. met: None when nothing
    was tried.
    """

    what: str
    found: str
    beside: str
    mark: str
    met: bool | None
    share: Share | None = None


def check_targets(judged: Sequence[Judgement]) -> list[Target]:
    """Return all marks, in the order in which the page tells them.

    Times are those that the one thread of a diagnosis worked: what the clock shows hangs on what
    else the machine does.
    """
    diagnosis = statistics.compare_methods(judged)[0]
    sizes, rig = statistics.collect_sizes(judged), statistics.collect_rig_constants(judged)
    ratios = statistics.list_ratios(judged)
    return [
        *(_at_least(WORDS[kind], diagnosis.right[kind], least) for kind, least in RIGHT.items()),
        _none("nothing hidden: false alarms", diagnosis.false_alarms),
        _at_least(
            "not in the catalogue: not misnamed, place right",
            statistics.count_located(judged),
            0.90,
        ),
        _at_most(
            "sizes: relative error",
            statistics.compute_quantiles(one.error for one in sizes),
            0.05,
            percent=True,
        ),
        _between(
            "95 % intervals that hold the truth",
            statistics.compute_coverage([*sizes, *rig]),
            0.90,
            0.98,
        ),
        _high_at_most(
            "held-out score / that of a fit told the truth",
            statistics.compute_quantiles(ratios),
            WITHIN,
        ),
        _at_most(
            "seconds of work for 60 s of recording",
            statistics.scale_seconds(judged, cpu=True),
            20.0,
        ),
        _worst_at_most(
            "seconds of work for 60 s, three effects",
            statistics.scale_seconds(judged, "triple", cpu=True),
            60.0,
        ),
    ]


def _at_least(what: str, found: Share, least: float) -> Target:
    met = None if found.value is None else found.value >= least
    return Target(what, *format_share(found), f"at least {_percent(least)}", met, found)


def _none(what: str, found: Share) -> Target:
    return Target(
        what, *format_share(found), "none", None if not found.tries else not found.hits, found
    )


def _between(what: str, found: Share, low: float, high: float) -> Target:
    """Ask for both ends; too many only where that cannot be chance, for of a few intervals all may well hold the truth."""
    met = (
        None
        if found.value is None or found.low is None
        else found.value >= low and found.low <= high
    )
    return Target(what, *format_share(found), f"{_percent(low)} to {_percent(high)}", met, found)


def _at_most(what: str, found: Quantiles, most: float, percent: bool = False) -> Target:
    """Ask it of the median."""

    def told(value: float | None) -> str:
        return _percent(value) if percent else number(value, 3)

    beside = f"90 % below {told(found.high)}, worst {told(found.worst)}, of {found.count}"
    met = None if found.median is None else found.median <= most
    return Target(
        what, f"median {told(found.median)}", beside, f"median at most {told(most)}", met
    )


def _high_at_most(what: str, found: Quantiles, most: float) -> Target:
    """Ask it of nine in ten: a single window near upright decides over the worst."""
    beside = f"median {number(found.median, 3)}, worst {number(found.worst, 3)}, of {found.count}"
    met = None if found.high is None else found.high <= most
    return Target(what, f"90 % below {number(found.high, 3)}", beside, f"90 % below {most:g}", met)


def _worst_at_most(what: str, found: Quantiles, most: float) -> Target:
    beside = f"median {number(found.median, 3)}, of {found.count}"
    met = None if found.worst is None else found.worst <= most
    return Target(what, f"worst {number(found.worst, 3)}", beside, f"at most {most:g}", met)


def format_share(found: Share) -> tuple[str, str]:
    """Return a share as "38 of 40 (95 %)" and its interval; dashes for none."""
    if found.value is None or found.low is None or found.high is None:
        return "none tried", NOTHING
    return (
        f"{found.hits} of {found.tries} ({_percent(found.value)})",
        f"[{_percent(found.low)}, {_percent(found.high)}]",
    )


def _percent(value: float | None) -> str:
    return NOTHING if value is None else f"{100 * value:.3g} %"

"""The targets of a proof, set before it began, and whether the results meet them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from pendulum_sysid.studies.proof.records import Judgement, NameCounts
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import (
    ORACLE_FACTOR,
    Pairs,
    Quantiles,
    collect_rig_constants,
    collect_sizes,
    compare_methods,
    compute_coverage,
    compute_quantiles,
    count_all_names,
    count_located,
    count_pairs,
    list_ratios,
    scale_seconds,
)
from pendulum_sysid.telling.tables import NOTHING, format_number

LEAST_RIGHT = {"single": 0.98, "pair": 0.95, "triple": 0.90, "quadruple": 0.90}
TITLES = {
    "single": "one effect: named right",
    "pair": "two effects: named right",
    "triple": "three effects: named right",
    "quadruple": "four effects: named right",
}
SIZE_ERROR = "sizes: relative error"
INTERVALS = "95 % intervals that hold the truth"
ORACLE = "held-out score / the oracle fit's"
# Of rigs with a rest other figures stand for these: those of two recordings, and of wrong names.
OF_RIGS_WITHOUT_REST = (*TITLES.values(), SIZE_ERROR, INTERVALS, ORACLE)
LEAST_LOCATED = 0.90
MOST_SIZE_ERROR = 0.05
COVERAGE = (0.90, 0.98)
MOST_SECONDS = 20.0
MOST_SECONDS_TRIPLE = 60.0
LEAST_AGREEING = 0.90
LEAST_OVERLAPPING = 0.93
MOST_WRONG = 0.02
WITHOUT_REST, NO_TARGET = "for rigs without a rest", "none: told apart"


@dataclass(frozen=True)
class Target:
    """Hold one target and its result.

    what: the quantity.
    result: the figure that is compared with the target.
    beside: the figure's 95 % interval, or other quantiles.
    target: the bound.
    met: None when nothing was tried.
    share: the counts behind the figure; None for a figure that is no share.
    is_meant: False for a figure that has no bound on these rigs.
    """

    what: str
    result: str
    beside: str
    target: str
    met: bool | None
    share: Share | None = None
    is_meant: bool = True


def check_targets(judgements: Sequence[Judgement]) -> list[Target]:
    """Return all targets, in the order of the page.

    Where a rest is always on, other targets hold: right names and the oracle fit are no measure of
    rigs that no set of effects explains. Times are CPU times of the diagnosis's one thread: wall
    times depend on what else the machine does.
    """
    has_rest = any(judgement.trial.seal.rest for judgement in judgements)
    return [
        _put_aside(target) if has_rest and target.what in OF_RIGS_WITHOUT_REST else target
        for target in _list_targets(judgements)
    ]


def _list_targets(judgements: Sequence[Judgement]) -> list[Target]:
    diagnosis = compare_methods(judgements)[0]
    sizes = collect_sizes(judgements)
    return [
        *(
            _require_at_least(TITLES[kind], diagnosis.right[kind], least)
            for kind, least in LEAST_RIGHT.items()
        ),
        _require_none("nothing hidden: false alarms", diagnosis.false_alarms),
        _require_at_least(
            "not in the catalogue: not misnamed, place right",
            count_located(judgements),
            LEAST_LOCATED,
        ),
        *_list_name_targets(count_all_names(judgements)),
        _require_median_at_most(
            SIZE_ERROR,
            compute_quantiles(size.relative_error for size in sizes),
            MOST_SIZE_ERROR,
            percent=True,
        ),
        _require_between(
            INTERVALS,
            compute_coverage([*sizes, *collect_rig_constants(judgements)]),
            *COVERAGE,
        ),
        _require_high_at_most(
            ORACLE,
            compute_quantiles(list_ratios(judgements)),
            ORACLE_FACTOR,
        ),
        *_list_time_targets(judgements),
        *_list_pair_targets(count_pairs(judgements)),
    ]


def _list_time_targets(judgements: Sequence[Judgement]) -> list[Target]:
    return [
        _require_median_at_most(
            "CPU seconds for 60 s of recording",
            scale_seconds(judgements, cpu=True),
            MOST_SECONDS,
        ),
        _require_worst_at_most(
            "CPU seconds for 60 s, three effects",
            scale_seconds(judgements, "triple", cpu=True),
            MOST_SECONDS_TRIPLE,
        ),
    ]


def _put_aside(target: Target) -> Target:
    """Return a target that is not meant for rigs with a rest: its figure stays."""
    return replace(target, target=WITHOUT_REST, met=None, is_meant=False)


def _list_name_targets(counts: NameCounts) -> list[Target]:
    """Return false names of all names, and concealed effects without a name, which has no bound.

    A wrong name leads astray; silence does not.
    """
    silent = Share(counts.silent, counts.concealed)
    return [
        _require_at_most("wrong names, of all names told", counts.wrong, counts.names, MOST_WRONG),
        Target(
            "silent: concealed effects without a name",
            *format_share(silent),
            NO_TARGET,
            None,
            silent,
            is_meant=False,
        ),
    ]


def _list_pair_targets(pairs: Pairs | None) -> list[Target]:
    if pairs is None:
        return []
    return [
        _require_at_least("two recordings of a rig: names agree", pairs.names, LEAST_AGREEING),
        _require_at_least("two recordings: intervals overlap", pairs.overlap, LEAST_OVERLAPPING),
        _require_at_least(
            "two recordings: intervals hold the truth", pairs.truth, LEAST_OVERLAPPING
        ),
        _require_at_least("improved twin no worse on the other recording", pairs.better, 1.0),
    ]


def format_share(share: Share) -> tuple[str, str]:
    """Return a share as "38 of 40 (95 %)", and its interval; a dash for no tries."""
    if share.value is None or share.low is None or share.high is None:
        return "none tried", NOTHING
    return (
        f"{share.hits} of {share.tries} ({_format_percent(share.value)})",
        f"[{_format_percent(share.low)}, {_format_percent(share.high)}]",
    )


def _require_at_least(what: str, share: Share, least: float) -> Target:
    met = None if share.value is None else share.value >= least
    return Target(what, *format_share(share), f"at least {_format_percent(least)}", met, share)


def _require_at_most(what: str, hits: int, tries: int, most: float) -> Target:
    share = Share(hits, tries)
    met = None if share.value is None else share.value <= most
    return Target(what, *format_share(share), f"at most {_format_percent(most)}", met, share)


def _require_none(what: str, share: Share) -> Target:
    met = None if not share.tries else not share.hits
    return Target(what, *format_share(share), "none", met, share)


def _require_between(what: str, share: Share, low: float, high: float) -> Target:
    """Demand both bounds of a share, the upper one only beyond chance.

    Of few intervals all may hold the truth.
    """
    met = None
    if share.value is not None and share.low is not None:
        met = share.value >= low and share.low <= high
    bounds = f"{_format_percent(low)} to {_format_percent(high)}"
    return Target(what, *format_share(share), bounds, met, share)


def _require_median_at_most(
    what: str, quantiles: Quantiles, most: float, percent: bool = False
) -> Target:
    def show(value: float | None) -> str:
        return _format_percent(value) if percent else format_number(value, 3)

    beside = (
        f"90 % below {show(quantiles.high)}, worst {show(quantiles.worst)}, of {quantiles.count}"
    )
    met = None if quantiles.median is None else quantiles.median <= most
    result = f"median {show(quantiles.median)}"
    return Target(what, result, beside, f"median at most {show(most)}", met)


def _require_high_at_most(what: str, quantiles: Quantiles, most: float) -> Target:
    """Demand a bound of nine in ten: a single window near upright decides over the worst."""
    beside = (
        f"median {format_number(quantiles.median, 3)}, worst {format_number(quantiles.worst, 3)}, "
        f"of {quantiles.count}"
    )
    met = None if quantiles.high is None else quantiles.high <= most
    result = f"90 % below {format_number(quantiles.high, 3)}"
    return Target(what, result, beside, f"90 % below {most:g}", met)


def _require_worst_at_most(what: str, quantiles: Quantiles, most: float) -> Target:
    beside = f"median {format_number(quantiles.median, 3)}, of {quantiles.count}"
    met = None if quantiles.worst is None else quantiles.worst <= most
    result = f"worst {format_number(quantiles.worst, 3)}"
    return Target(what, result, beside, f"at most {most:g}", met)


def _format_percent(value: float | None) -> str:
    return NOTHING if value is None else f"{100 * value:.3g} %"

"""What a planned recording will be able to find and to part, asked of the twin before anything is played on the rig.

The twin plays the plan, its encoders round, and every effect of the catalogue is asked, one at a
time: at which size would it stand out of the noise although the rig's constants do what they can
to explain it (`separation`), and from which other effects will it not be told at a typical size?
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.exchange import Question, tied
from pendulum_sysid.finding.hypotheses import (
    Shape,
    choose_typical,
    list_possible_effects,
    make_shapes,
)
from pendulum_sysid.finding.separation import (
    CERTAIN,
    NOTHING,
    Columns,
    compute_columns,
    compute_deviations,
    compute_naming_threshold,
    compute_rest,
    list_doubles,
    spread_indices,
)
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.linearised import Problem
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.planning.planned_run import make_hanging_lanes, play_plans
from pendulum_sysid.records import Recording
from pendulum_twin.effects.effect import Form
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.signals import Floats, Signals

SECANT_STEPS = 4  # in which a size is found that stands out as far as asked
SIZE_TOLERANCE = 0.2  # of its logarithm
LEAST_LOG_SIZE = 14.0  # of the logarithm by which it may be smaller than the typical size
MOST_TYPICAL_SIZES = 100.0  # typical sizes at most: what is not found there is not found


@dataclass(frozen=True)
class Encoders:
    """Hold how finely the rig measures: counts a turn of the pole, one step of the cart's encoder (m)."""

    pole_counts: int = 4096
    cart_step_m: float = 57e-6


@dataclass(frozen=True)
class EffectRow:
    """Say of one effect what a plan will show of it.

    parameter, unit: of the size that the numbers below are; None for an effect that is on or off.
    typical: all parameters at a typical size, name -> value; errors: standard errors at which it
    stands. found_from: the size that stands FOUND standard errors out of the noise; named_from:
    the size that a diagnosis names; None where no size does. not_told_from: effects that could
    take its place at its typical size. by_no_motion: effects that look the same in every motion.
    """

    effect: str
    parameter: str | None
    unit: str
    typical: dict[str, float]
    errors: float
    found_from: float | None
    named_from: float | None
    not_told_from: tuple[str, ...]
    by_no_motion: tuple[str, ...]


@dataclass(frozen=True)
class Constant:
    """Say how well a plan will fix one of the rig's constants: its value, and half the width of its 95 % interval."""

    name: str
    unit: str
    value: float
    half_width: float
    identifiable: bool


@dataclass(frozen=True)
class Isolability:
    """Hold what a plan will show of a rig. seconds: of the plan. farthest_m: of the cart from the middle."""

    twin: str
    seconds: float
    farthest_m: float
    encoders: Encoders
    rows: tuple[EffectRow, ...]
    constants: tuple[Constant, ...]


def predict_isolability(
    twin: Twin, plan: Excitation, encoders: Encoders, rows: Collection[str] | None = None
) -> Isolability:
    """Return what a recording of a plan on a rig like this twin will be able to find and to part.

    rows: names of the effects to ask about; None for all that the rig can have and the twin does
    not hold.

    Raises BadInputError when the twin's cart would leave the rail, or the plan is too short to be
    cut into windows.
    """
    theta = make_theta(twin)
    (run,) = _play_twins(twin, theta[None], plan, encoders)
    farthest = float(np.max(np.abs(run.cart))) if run.cart is not None else 0.0
    if twin.rig.rail_half_length_m is not None and not farthest < twin.rig.rail_half_length_m:
        raise BadInputError(
            f"plan: expected the twin's cart within the rail of +-{twin.rig.rail_half_length_m:g} m, found it at "
            f"{farthest:.3g} m: play it weaker"
        )
    case = make_case(Recording(twin.name, "", run), smooth_state(run), twin)
    problem, power = _make_problem(case)
    free = list_free_parameters(case.twin, tuple(twin.effects), case.scales)
    asked = [
        e
        for e in list_possible_effects(case.twin.rig)
        if e.name not in twin.effects and (rows is None or e.name in rows)
    ]
    middle = tuple(choose_typical(make_shapes(theta, e, case.scales)) for e in asked)
    found = compute_columns(
        problem, theta, free, power, (), np.array([one.whole for one in middle])
    )
    needed = compute_naming_threshold(
        int(decisions.DECIDING_SHARE * len(case.signals)) * len(case.noise)
    )
    shares = [
        _find_shares(problem, theta, free, power, middle, found, errors)
        for errors in (decisions.FOUND_STANDARD_ERRORS, needed)
    ]
    rivals = _find_inseparable(
        case,
        problem,
        power,
        free,
        middle,
        _play_twins(twin, np.array([s.whole for s in middle]), plan, encoders),
    )
    made = tuple(
        _make_row(
            compute_rest(found, found.asked(k)).distance,
            one,
            shares[0][k],
            shares[1][k],
            rivals[k],
            encoders,
        )
        for k, one in enumerate(middle)
    )
    return Isolability(
        twin.name, plan.seconds, farthest, encoders, made, _list_constants(found, theta)
    )


def _play_twins(twin: Twin, theta: Floats, plan: Excitation, encoders: Encoders) -> list[Signals]:
    """Return what encoders show of twins with words (twins, SIZE) on which a plan is played."""
    run = play_plans(
        make_hanging_lanes(theta, 1 / plan.rate_hz), [plan] * len(theta), len(plan.commands)
    )
    return [_encode_run(run.signals(k), encoders, twin) for k in range(len(theta))]


def _find_inseparable(
    case: Case,
    problem: Problem,
    power: Floats,
    free: tuple[Free, ...],
    middle: tuple[Shape, ...],
    runs: list[Signals],
) -> list[tuple[str, ...]]:
    """Return what each effect at its typical size cannot be told from on its own run."""
    effects, held, found = list_possible_effects(case.twin.rig), tuple(case.twin.effects), []
    for one, run in zip(middle, runs, strict=True):
        state = smooth_state(run)
        windows = replace(problem.windows, starts=state.states[problem.windows.begin])
        own = replace(problem, signals=run, windows=windows)
        asked = Question(own, power, one.whole, one.effect, held, free, case.scales)
        found.append(
            tuple(
                tie.rival
                for tie in tied(asked, effects, decisions.APART_STANDARD_ERRORS)
                if tie.rival is not None
            )
        )
    return found


def _encode_run(run: Signals, encoders: Encoders, twin: Twin) -> Signals:
    """Return a run as encoders show it, with the joints that the rig has."""
    turn = 2 * np.pi / encoders.pole_counts
    cart = (
        None
        if run.cart is None or not twin.rig.has_cart
        else _round_to_step(run.cart, encoders.cart_step_m)
    )
    pole = None if run.pole is None or not twin.rig.has_pole else _round_to_step(run.pole, turn)
    return replace(run, cart=cart, pole=pole)


def _round_to_step(values: Floats, step: float) -> Floats:
    return np.round(values / step) * step


def _make_problem(case: Case) -> tuple[Problem, Floats]:
    """Return windows spread over the run, and the noise's power as if all that a diagnosis decides on were there."""
    windows = cut_windows(case.signals, case.state, WINDOW_S)
    if not len(windows):
        raise BadInputError(
            f"plan: expected at least {WINDOW_S:g} s, found {case.signals.seconds:g} s"
        )
    kept = spread_indices(len(windows))
    weight = decisions.DECIDING_SHARE * len(windows) / len(kept)
    return case.problem(windows.pick(kept)), case.noise**2 / weight


def _find_shares(
    problem: Problem,
    theta: Floats,
    free: tuple[Free, ...],
    power: Floats,
    middle: tuple[Shape, ...],
    found: Columns,
    asked: float,
) -> list[float | None]:
    """Return the share of its typical size at which each effect stands so many standard errors out of the noise.

    By secants on logarithms: effects do not all grow in proportion to their size.
    """
    old, steep = np.zeros(len(middle)), np.ones(len(middle))
    errors = np.log(np.maximum(_compute_distances(found, len(middle)), NOTHING) / asked)
    share = np.clip(-errors, -LEAST_LOG_SIZE, np.log(MOST_TYPICAL_SIZES))
    for _ in range(SECANT_STEPS):
        tried = np.array(
            [one.between(theta, float(s)) for one, s in zip(middle, np.exp(share), strict=True)]
        )
        again = compute_columns(problem, theta, free, power, (), tried)
        new = np.log(np.maximum(_compute_distances(again, len(middle)), NOTHING) / asked)
        moved = share - old
        steep = np.where(
            np.abs(moved) > 1e-3, (new - errors) / np.where(moved == 0.0, 1.0, moved), steep
        )
        steep = np.clip(steep, 0.3, 5.0)
        old, errors = share, new
        share = np.clip(share - new / steep, -LEAST_LOG_SIZE, np.log(MOST_TYPICAL_SIZES))
    return [
        float(np.exp(s)) if abs(e) < SIZE_TOLERANCE else None
        for s, e in zip(old, errors, strict=True)
    ]


def _compute_distances(found: Columns, count: int) -> Floats:
    return np.array([compute_rest(found, found.asked(k)).distance for k in range(count)])


def _make_row(
    errors: float,
    one: Shape,
    share: float | None,
    named: float | None,
    rivals: tuple[str, ...],
    encoders: Encoders,
) -> EffectRow:
    effect, slot = one.effect, SLOTS[one.effect.name]
    main = next(
        (p for p in effect.parameters if not p.shape),
        effect.parameters[0] if effect.parameters else None,
    )
    # the zero of an angle is known no better than to half a step of its encoder
    finest = (
        np.pi / encoders.pole_counts
        if main and effect.form is Form.MEASURE and main.unit == "rad"
        else 0.0
    )

    def size(of: float | None) -> float | None:
        if of is None or main is None:
            return None
        value = float(one.between(one.whole, of)[slot.start + effect.parameters.index(main)])
        return value if main.shape else max(value, main.neutral + max(main.least, finest))

    return EffectRow(
        effect.name,
        None if main is None else main.name,
        "" if main is None else main.unit,
        {p.name: float(one.whole[slot.start + n]) for n, p in enumerate(effect.parameters)},
        errors,
        size(share),
        size(named),
        rivals if errors >= decisions.FOUND_STANDARD_ERRORS else (),
        tuple(e.name for e in list_doubles(effect)),
    )


def _list_constants(found: Columns, theta: Floats) -> tuple[Constant, ...]:
    """Return how well the rig's constants will be fixed, all of them free together."""
    count = len(found.free)
    made = []
    for one, deviation in zip(
        found.free, compute_deviations(found.normal[:count, :count]), strict=True
    ):
        half = float(CERTAIN * deviation * one.size)
        value = one.get(theta)
        made.append(
            Constant(one.name, one.unit, value, half, bool(half < max(abs(value), one.size)))
        )
    return tuple(made)

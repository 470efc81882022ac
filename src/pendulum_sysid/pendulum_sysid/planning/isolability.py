"""Predict with the twin what a planned recording will be able to find and to tell apart.

The twin plays the plan, and its encoders round. For every effect of the catalogue follow two
answers: the size at which it stands out of the noise although the rig's constants explain as much
of it as they can (`separation`), and the effects that it cannot be told from at a typical size.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.exchange import ExchangeQuestion, find_near_effects
from pendulum_sysid.finding.hypotheses import (
    EffectShape,
    choose_typical,
    list_possible_effects,
    make_shapes,
)
from pendulum_sysid.finding.journal import Progress, report_nothing
from pendulum_sysid.finding.separation import (
    NOTHING,
    ColumnProducts,
    compute_columns,
    compute_deviations,
    compute_naming_threshold,
    compute_rest,
    list_doubles,
    spread_indices,
)
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.planning.planned_run import make_hanging_lanes, play_plans
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Form
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.signals import Signals

SECANT_STEPS = 4  # towards the size that stands out as far as is asked
SIZE_TOLERANCE = 0.2  # of the logarithm of the standard errors, at the last step
LEAST_LOG_SIZE = 14.0  # natural logarithm by which a size may be below the typical size
MOST_TYPICAL_SIZES = 100.0  # largest size that is tried, in typical sizes


@dataclass(frozen=True)
class Encoders:
    """Hold the resolution of the sensors: counts a turn of the pole, step of the cart (m)."""

    pole_counts: int = 4096
    cart_step_m: float = 57e-6


@dataclass(frozen=True)
class EffectRow:
    """Hold what a plan will show of an effect.

    parameter, unit: what `found_from` and `named_from` are a size of; None for an effect that is
        on or off.
    typical: parameter's name -> value at a typical size.
    errors: standard errors by which the typical size stands out of the noise.
    found_from: the size that stands SURE_STANDARD_ERRORS out of the noise; None for no size.
    named_from: the size that a diagnosis names; None for no size.
    not_told_from: effects that could take its place at its typical size.
    by_no_motion: effects that look the same in every motion.
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
    """Hold how well a plan fixes a constant of the rig.

    half_width: of the 95 % interval, in `unit`.
    """

    name: str
    unit: str
    value: float
    half_width: float
    identifiable: bool


@dataclass(frozen=True)
class Isolability:
    """Hold what a plan will show of a rig.

    twin: name of the twin.
    seconds: length of the plan.
    farthest_m: largest distance of the cart from the middle.
    """

    twin: str
    seconds: float
    farthest_m: float
    encoders: Encoders
    rows: tuple[EffectRow, ...]
    constants: tuple[Constant, ...]


def predict_isolability(
    twin: Twin,
    plan: Excitation,
    encoders: Encoders,
    rows: Collection[str] | None = None,
    report: Progress = report_nothing,
) -> Isolability:
    """Predict what a recording of a plan on a rig like this twin can find and tell apart.

    encoders: resolution of the rig's sensors.
    rows: names of the effects; None for all that the rig can have and the twin has not.
    report: takes a line of progress.

    Raises BadInputError when the twin's cart would leave the rail, or the plan is too short to be
    cut into windows.
    """
    report("playing the plan on the twin")
    theta = make_theta(twin)
    (run,) = _play_twins(twin, theta[None], plan, encoders)
    farthest = _check_on_rail(run, twin)
    case = make_case(Recording(twin.name, "", run), smooth_state(run), twin)
    problem, power = _make_problem(case)
    free = list_free_parameters(case.twin, tuple(twin.effects), case.scales)
    effects = [
        e
        for e in list_possible_effects(case.twin.rig)
        if e.name not in twin.effects and (rows is None or e.name in rows)
    ]
    middle = tuple(choose_typical(make_shapes(theta, e, case.scales)) for e in effects)
    thetas = np.array([shape.whole for shape in middle])
    columns = compute_columns(problem, theta, free, power, (), thetas)
    needed = compute_naming_threshold(
        int(decisions.DECIDING_SHARE * len(case.signals)) * len(case.noise)
    )
    report(f"sizes from which {len(middle)} effects show")
    detectable, nameable = (
        _find_shares(problem, theta, free, power, middle, columns, errors)
        for errors in (decisions.SURE_STANDARD_ERRORS, needed)
    )
    runs = _play_twins(twin, thetas, plan, encoders)
    inseparable = _find_inseparable(case, problem, power, free, middle, runs, report)
    distances = _compute_distances(columns, len(middle))
    lines = zip(distances.tolist(), middle, detectable, nameable, inseparable, strict=True)
    effect_rows = tuple(_make_row(*line, encoders, free) for line in lines)
    constants = _list_constants(columns, theta)
    return Isolability(twin.name, plan.seconds, farthest, encoders, effect_rows, constants)


def _check_on_rail(run: Signals, twin: Twin) -> float:
    """Return the largest distance of the cart from the middle (m); refuse a run off the rail."""
    farthest = float(np.max(np.abs(run.cart))) if run.cart is not None else 0.0
    if twin.rig.rail_half_length_m is not None and not farthest < twin.rig.rail_half_length_m:
        raise BadInputError(
            "plan: expected the twin's cart within the rail of "
            f"+-{twin.rig.rail_half_length_m:g} m, found it at {farthest:.3g} m: play it weaker"
        )
    return farthest


def _play_twins(twin: Twin, theta: Floats, plan: Excitation, encoders: Encoders) -> list[Signals]:
    """Play a plan on twins, theta (twins, SIZE), and return what their encoders show."""
    run = play_plans(
        make_hanging_lanes(theta, 1 / plan.rate_hz), [plan] * len(theta), len(plan.commands)
    )
    return [_encode_run(run.make_signals(k), encoders, twin) for k in range(len(theta))]


def _find_inseparable(
    case: Case,
    problem: Problem,
    power: Floats,
    free: tuple[Free, ...],
    middle: tuple[EffectShape, ...],
    runs: list[Signals],
    report: Progress,
) -> list[tuple[str, ...]]:
    """Return, for each effect at its typical size, the effects that its own run cannot exclude."""
    effects, given = list_possible_effects(case.twin.rig), tuple(case.twin.effects)
    inseparable = []
    for k, (shape, run) in enumerate(zip(middle, runs, strict=True)):
        report(f"what looks like {shape.effect.name} ({k + 1} of {len(middle)})")
        state = smooth_state(run)
        windows = replace(problem.windows, start_states=state.states[problem.windows.begin])
        own = replace(problem, signals=run, windows=windows)
        question = ExchangeQuestion(
            own, power, shape.whole, shape.effect, given, free, case.scales
        )
        ties = find_near_effects(question, effects, decisions.APART_STANDARD_ERRORS)
        inseparable.append(tuple(tie.rival for tie in ties if tie.rival is not None))
    return inseparable


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
    """Return windows spread over the run, and the power of the noise.

    The power is scaled as if all windows that a diagnosis decides on were there.
    """
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
    middle: tuple[EffectShape, ...],
    columns: ColumnProducts,
    errors: float,
) -> list[float | None]:
    """Return the share of its typical size at which each effect stands out of the noise.

    columns: of the effects at their typical sizes.
    errors: standard errors that count as standing out.

    Secant steps on logarithms, because effects do not all grow in proportion to their size.
    """

    def compute_excess(shown: ColumnProducts) -> Floats:
        return np.log(np.maximum(_compute_distances(shown, len(middle)), NOTHING) / errors)

    old, slope = np.zeros(len(middle)), np.ones(len(middle))
    excess = compute_excess(columns)
    share = np.clip(-excess, -LEAST_LOG_SIZE, np.log(MOST_TYPICAL_SIZES))
    for _ in range(SECANT_STEPS):
        sizes = zip(middle, np.exp(share).tolist(), strict=True)
        thetas = np.array([shape.between(theta, size) for shape, size in sizes])
        new = compute_excess(compute_columns(problem, theta, free, power, (), thetas))
        step = share - old
        secant = (new - excess) / np.where(step == 0.0, 1.0, step)
        slope = np.clip(np.where(np.abs(step) > 1e-3, secant, slope), 0.3, 5.0)
        old, excess = share, new
        share = np.clip(share - new / slope, -LEAST_LOG_SIZE, np.log(MOST_TYPICAL_SIZES))
    return [
        float(np.exp(s)) if abs(e) < SIZE_TOLERANCE else None
        for s, e in zip(old, excess, strict=True)
    ]


def _compute_distances(columns: ColumnProducts, count: int) -> Floats:
    """Return by how many standard errors each effect stands out of the noise."""
    return np.array([compute_rest(columns, columns.get_target(k)).distance for k in range(count)])


def _make_row(
    errors: float,
    shape: EffectShape,
    detectable: float | None,
    nameable: float | None,
    inseparable: tuple[str, ...],
    encoders: Encoders,
    free: tuple[Free, ...],
) -> EffectRow:
    """Return the row of an effect.

    detectable, nameable: smallest shares of its typical size; None for an effect without a size.
    free: the rig's constants that a fit changes.
    """
    effect, slot = shape.effect, SLOTS[shape.effect.name]
    sizes = effect.sizes or effect.parameters
    main = sizes[0] if sizes else None
    # the zero of an angle is known no better than to half a step of its encoder
    is_angle = main is not None and effect.form is Form.MEASURE and main.unit == "rad"
    finest = np.pi / encoders.pole_counts if is_angle else 0.0

    def find_size(share: float | None) -> float | None:
        if share is None or main is None:
            return None
        place = slot.start + effect.parameters.index(main)
        value = float(shape.between(shape.whole, share)[place])
        return value if main.shape else max(value, main.neutral + max(main.least, finest))

    return EffectRow(
        effect.name,
        None if main is None else main.name,
        "" if main is None else main.unit,
        {p.name: float(shape.whole[slot.start + n]) for n, p in enumerate(effect.parameters)},
        errors,
        find_size(detectable),
        find_size(nameable),
        inseparable if errors >= decisions.SURE_STANDARD_ERRORS else (),
        tuple(e.name for e in list_doubles(effect, free)),
    )


def _list_constants(columns: ColumnProducts, theta: Floats) -> tuple[Constant, ...]:
    """Return how well the plan fixes the rig's constants, all of them free together."""
    count = len(columns.free)
    deviations = compute_deviations(columns.normal[:count, :count])
    constants = []
    for parameter, deviation in zip(columns.free, deviations, strict=True):
        half = float(decisions.INTERVAL_DEVIATIONS * deviation * parameter.size)
        value = parameter.get(theta)
        identifiable = bool(half < max(abs(value), parameter.size))
        constants.append(Constant(parameter.name, parameter.unit, value, half, identifiable))
    return tuple(constants)

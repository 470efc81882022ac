"""From which of two samples a command acted that came midway between them: the cart decides.

A command that acts from the nearest sample on, and whose stamp is off by a fraction of a period,
may count a sample too early or too late. The cart's velocity then jumps where no force is. A
filter finds the height of such a jump at each sample: generalised least squares of a short stretch
of the cart's unexplained acceleration, whose noise is that of second differences of a position,
with a force that drifts evenly beside the jump. A jump shows at its neighbours, too: of commands
within a filter's reach the one that gains most changes first, and the others are weighed again.
Where the cart hardly moves, dry friction takes what a command gives, and nothing is asked.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import correlate1d, maximum_filter1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import (
    differentiate_twice,
    list_other_forces,
    make_second_differences,
)
from pendulum_sysid.cleaning.clock import hold_commands
from pendulum_sysid.cleaning.drive_curve import DriveCurve, fit_drive_curve
from pendulum_sysid.cleaning.reducing import is_too_fast
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import compute_slow_speed
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.signals import Signals

SHIFTS = 17  # tried from end to end of COMMAND_CLOCK_OFF: a twentieth of a period apart
MOST_BETWEEN = 8  # commands between two samples; of a longer burst no time is believed
PASSES = 50  # at most: commands that were settled change how their neighbours are weighed
SPREAD_OF_NORMAL = 1.4826  # standard deviation over median absolute deviation


def settle_commands(
    signals: Signals,
    smoothed: Callable[[], SmoothState],
    stamps: Floats,
    commands: Floats,
) -> tuple[Signals, CommandDoubt | None]:
    """Return the signals with each command that came midway at the sample from which it acted.

    Returns the commands that are in doubt, too; None where there are none.

    First all commands answer together by how much the samples' clock is off; then each command
    that came midway between two samples answers for itself. At rates of which samples will
    be left out, commands stay at the nearest sample.

    signals: with a cart.
    smoothed: returns the smoothed motion; is called only where a command is in doubt, for
        smoothing takes time.
    stamps, commands: (m,) when each command came, s, rising, and its value.
    """
    since = (stamps - stamps[0]) / max(stamps[-1] - stamps[0], signals.period_s) - 0.5

    def hold(shift: float, drift: float) -> Floats:
        """Return the commands (n,) if all had come later: by so many periods, and a drift."""
        later = stamps + (shift + drift * since) * signals.period_s
        return hold_commands(signals.clock_s, signals.period_s, later, commands, nearest=True)

    far = decisions.COMMAND_CLOCK_OFF
    if is_too_fast(signals) or np.array_equal(hold(-far, 0.0), hold(far, 0.0)):
        return replace(signals, command=hold(0.0, 0.0)), None
    balance = _make_balance(replace(signals, command=hold(0.0, 0.0)), smoothed())
    shift, drift = _find_shift(balance, hold)
    signals = replace(signals, command=hold(shift, drift))
    later = stamps + (shift + drift * since) * signals.period_s
    doubt = _find_doubt(signals, later, commands)
    if doubt is None:
        return signals, None
    for _ in range(PASSES):
        net = _weigh(signals, balance, doubt) - doubt.added_costs
        options = np.argmax(net, axis=1)
        which = _list_best(doubt.samples, np.max(net, axis=1), len(signals))
        if not len(which):
            break
        doubt = doubt.choose(which, options[which])
        signals = replace(signals, command=doubt.put_into(signals.command))
    return signals, doubt


def _list_best(samples: Ints, gains: Floats, count: int) -> Ints:
    """Return which changes gain anything, and most within the reach of their filters.

    gains: (k,) nats beyond what each change costs.
    count: samples of the recording.
    """
    at = np.zeros(count)
    at[samples] = gains
    most = maximum_filter1d(at, 4 * decisions.COMMAND_SIDE + 1)[samples]
    return np.flatnonzero((gains > 0) & (gains >= most))


def _find_slow(state: SmoothState) -> Mask:
    """Return where a filter reaches a cart that hardly moves: dry friction holds it, (n,)."""
    slow = np.abs(state.states[:, 2]) < compute_slow_speed(state)
    reached: Mask = maximum_filter1d(slow, 2 * decisions.COMMAND_SIDE + 1)
    return reached


def _find_doubt(signals: Signals, stamps: Floats, commands: Floats) -> CommandDoubt | None:
    """Return which commands are in doubt, the commands at the nearest sample chosen.

    Of the commands that came between a sample and the next sample, some acted from the sample and
    the others from the next: an option is how many, and its cost grows with how far from the
    middle they are parted.
    """
    changes = np.diff(commands, prepend=np.nan) != 0.0  # a driver may send a command again
    stamps, commands = stamps[changes], commands[changes]
    clock, period_s = signals.clock_s, signals.period_s
    first = np.searchsorted(stamps, clock, side="right")
    count = np.searchsorted(stamps, clock + period_s, side="left") - first
    rows = np.flatnonzero((count > 0) & (first > 0))
    options = np.arange(min(int(np.max(count[rows], initial=0)), MOST_BETWEEN) + 1)
    first, count = first[rows, None], count[rows, None]
    following = np.minimum(first + options, len(stamps) - 1)
    came = np.where(options < count, (stamps[following] - clock[rows, None]) / period_s, 1.0)
    since = np.column_stack([np.zeros(len(rows)), came[:, :-1]])
    apart = np.maximum(since - 0.5, 0.0) + np.maximum(0.5 - came, 0.0)
    apart[options > count] = np.inf
    dear = decisions.COMMAND_MOVED_NATS + decisions.COMMAND_FARTHER_NATS * apart
    costs = np.where(apart < decisions.COMMAND_MIDWAY, dear, np.inf)
    nearest = np.argmin(apart, axis=1)
    costs[np.arange(len(rows)), nearest] = 0.0
    doubtful = np.isfinite(costs).sum(axis=1) > 1
    doubtful &= count[:, 0] <= MOST_BETWEEN
    if not doubtful.any():
        return None
    values = np.where(
        np.isfinite(costs), commands[np.minimum(first + options, len(commands)) - 1], 0.0
    )
    return CommandDoubt(
        rows[doubtful], values[doubtful], costs[doubtful], nearest[doubtful].astype(np.int64)
    )


@dataclass(frozen=True)
class Balance:
    """Hold what the cart's acceleration is explained by, beside the command.

    rows: (rows,) samples that the balance is fitted to.
    target: (n,) m/s^2.
    others: (n, columns) of all other forces.
    drive: what the drive makes of commands.
    late: whole samples by which the command comes late.
    slow: (n,) whether a filter reaches a cart that hardly moves, which dry friction holds.
    """

    rows: Ints
    target: Floats
    others: Floats
    drive: DriveCurve
    late: int
    slow: Mask

    def explain(self, command: Floats) -> tuple[Floats, float]:
        """Return the acceleration that is left, (n,), m/s^2, and that per unit of the drive."""
        # second differences show by half a command of this sample and of the sample before
        driven = self.drive.answer(command)
        answer = np.roll(correlate1d(driven, [0.5, 0.5, 0.0], mode="nearest"), self.late)
        columns = np.column_stack([answer, self.others])
        weights = np.linalg.lstsq(columns[self.rows], self.target[self.rows], rcond=None)[0]
        return self.target - columns @ weights, float(weights[0])


def _make_balance(signals: Signals, state: SmoothState) -> Balance:
    assert signals.cart is not None
    rows = _list_rows(signals)
    target = differentiate_twice(signals.cart, signals.period_s, 1)
    others = list_other_forces(signals, state, 1)
    drive = fit_drive_curve(signals.command, make_second_differences(signals, state))
    latest = round(decisions.ANSWER_LATEST_S / signals.period_s)
    slow = _find_slow(state)
    balances = [Balance(rows, target, others, drive, late, slow) for late in range(latest + 1)]
    return min(balances, key=lambda each: np.std(each.explain(signals.command)[0][rows]))


def _find_shift(balance: Balance, hold: Callable[[float, float], Floats]) -> tuple[float, float]:
    """Return shift and drift of the commands, periods, at which they explain the cart best."""

    def measure(shift: float, drift: float) -> float:
        left = float(np.std(balance.explain(hold(shift, drift))[0][balance.rows]))
        return len(balance.rows) * math.log(max(left, 1e-300))  # nats, up to a constant

    far = decisions.COMMAND_CLOCK_OFF
    steps = [0.0, *np.linspace(-far, far, SHIFTS).tolist()]
    at_stamps = measure(0.0, 0.0)
    shift = min(steps, key=lambda shift: measure(shift, 0.0))
    drift = min(steps, key=lambda drift: measure(shift, drift))
    shift = min(steps, key=lambda shift: measure(shift, drift))
    farther = decisions.COMMAND_FARTHER_NATS * (abs(shift) + abs(drift))
    gain = at_stamps - measure(shift, drift)
    return (shift, drift) if gain > decisions.COMMAND_MOVED_NATS + farther else (0.0, 0.0)


def _weigh(signals: Signals, balance: Balance, doubt: CommandDoubt) -> Floats:
    """Return the gain of log likelihood, nats, by each option, (k, options).

    A cart that hardly moves says nothing: dry friction holds it.
    """
    left, per_drive = balance.explain(signals.command)
    usable = np.zeros(len(left))
    usable[balance.rows] = left[balance.rows]
    jumps = correlate1d(usable, _make_filter(), mode="constant")
    moving = np.abs(jumps[balance.rows[~balance.slow[balance.rows]]])
    noise = (SPREAD_OF_NORMAL * float(np.median(moving)) if moving.size else 0.0) or np.inf
    jumps = np.roll(jumps, -balance.late)[doubt.samples]
    answer = balance.drive.answer
    driven = answer(doubt.values.ravel()).reshape(doubt.values.shape)
    lacking = per_drive * (driven - answer(signals.command[doubt.samples])[:, None])
    gains: Floats = lacking * (2 * jumps[:, None] - lacking) / (2 * noise**2)
    return np.where(balance.slow[doubt.samples][:, None], 0.0, gains)


def _list_rows(signals: Signals) -> Ints:
    """Return the samples whose neighbours are measured, too."""
    valid = signals.cart_valid if signals.pole is None else signals.cart_valid & signals.pole_valid
    good = correlate1d(valid.astype(np.float64), np.ones(3), mode="constant") > 3 - 1e-9
    for begin in (s.start for s in signals.stretches):
        good[max(begin - 1, 0) : begin + 1] = False
    return np.flatnonzero(good)


def _make_filter() -> Floats:
    """Return the weights (2 COMMAND_SIDE + 1,) that give a jump at the filter's centre.

    A command at sample k shows by half in the second differences at k and k + 1.
    """
    side = decisions.COMMAND_SIDE
    count = 2 * side + 1
    second = np.diff(np.eye(count + 2), 2, axis=0)
    whitening = np.linalg.inv(np.linalg.cholesky(second @ second.T))
    at = np.arange(count) - side
    jump = 0.5 * ((at == 0) | (at == 1))
    columns = whitening @ np.column_stack([jump, np.ones(count), at])
    weights: Floats = (np.linalg.pinv(columns) @ whitening)[0]
    return weights

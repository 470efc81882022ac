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
from scipy.linalg import orth
from scipy.ndimage import correlate1d, maximum_filter1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import (
    differentiate_twice,
    list_other_forces,
    make_second_differences,
)
from pendulum_sysid.cleaning.command_arrivals import ClockBounds, ClockError, CommandArrivals
from pendulum_sysid.cleaning.drive_curve import DriveCurve, fit_drive_curve
from pendulum_sysid.cleaning.earlier_samples import delay_samples, find_earlier_samples
from pendulum_sysid.cleaning.reducing import is_too_fast
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import compute_slow_speed
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.signals import Signals

TURNS = 5  # at most: the clock is asked beside the commands that were settled
PASSES = 50  # at most: commands that were settled change how their neighbours are weighed
# of normal errors: a share of them, and the standard deviations within which it lies
QUANTILES_OF_NORMAL = ((0.5, 0.674), (0.9, 1.645), (0.98, 2.326))


def settle_commands(
    signals: Signals,
    smoothed: Callable[[], SmoothState],
    arrivals: CommandArrivals,
    bounds: ClockBounds,
) -> tuple[Signals, CommandDoubt | None]:
    """Return the signals with each command that came midway at the sample from which it acted.

    Returns the commands that are in doubt, too; None where there are none.

    All commands together say by how much the samples' clock is off; then each command that came
    midway between two samples answers for itself, and the clock is asked again beside them. At
    rates of which samples will be left out, commands stay at the nearest sample.

    signals: with a cart, and with commands as they count if the clock is off as expected.
    smoothed: returns the smoothed motion; is called only where a command is in doubt, for
        smoothing takes time.
    arrivals: when commands came.
    bounds: by how much the samples' clock may be off.
    """
    expected = signals.command
    if is_too_fast(signals) or not arrivals.leave_doubt:
        return signals, None
    balance = _make_balance(signals, smoothed())

    def measure(clock: ClockError) -> float:
        return balance.measure(arrivals.weigh(clock).put_into(expected))

    clock = bounds.search(measure, bounds.expected)
    doubt = arrivals.weigh(clock)
    for _ in range(TURNS):
        signals = replace(signals, command=doubt.put_into(signals.command))
        before = clock
        clock = arrivals.find_clock_error(balance.weigh(signals.command, doubt), bounds, before)
        doubt = arrivals.weigh(clock).choose_where_possible(doubt.chosen)
        doubt = _settle_each(signals.command, balance, doubt)
        if clock == before:
            break
    signals = replace(signals, command=doubt.put_into(signals.command))
    return signals, doubt.pick_doubtful()


def _settle_each(command: Floats, balance: Balance, doubt: CommandDoubt) -> CommandDoubt:
    """Return the doubt with the options for which the cart speaks most, each command for itself.

    command: (n,) PWM fraction.
    """
    for _ in range(PASSES):
        command = doubt.put_into(command)
        net = balance.weigh(command, doubt) - doubt.added_costs
        options = np.argmax(net, axis=1)
        which = _list_best(doubt.samples, np.max(net, axis=1), len(command))
        if not len(which):
            break
        doubt = doubt.choose(which, options[which])
    return doubt


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


@dataclass(frozen=True)
class Balance:
    """Hold what is left of the cart's acceleration beside all forces but the drive's.

    rows: (rows,) samples that the balance is fitted to.
    basis: (rows, columns) orthonormal, of all other forces.
    target: (rows,) m/s^2, without what the other forces explain.
    drive: what the drive makes of commands.
    late: whole samples by which the command comes late.
    slow: (n,) whether a filter reaches a cart that hardly moves, which dry friction holds.
    stretch_begins: first sample of every stretch; no command acts in a later stretch.
    """

    rows: Ints
    basis: Floats
    target: Floats
    drive: DriveCurve
    late: int
    slow: Mask
    stretch_begins: tuple[int, ...]

    def explain(self, command: Floats) -> tuple[Floats, float]:
        """Return the acceleration that is left, (rows,), m/s^2, and that per unit of the drive."""
        # second differences show by half a command of this sample and of the sample before
        driven = self.drive.answer(command)
        driven = delay_samples(driven, self.late, self.stretch_begins)
        answer = correlate1d(driven, [0.5, 0.5, 0.0], mode="nearest")
        answer = _take_out(self.basis, answer[self.rows])
        square = float(answer @ answer)
        per_drive = float(answer @ self.target) / square if square else 0.0
        return self.target - per_drive * answer, per_drive

    def measure(self, command: Floats) -> float:
        """Return the log likelihood of a command, nats, up to a constant."""
        left = float(np.std(self.explain(command)[0]))
        return -len(self.rows) * math.log(max(left, 1e-300))

    def weigh(self, command: Floats, doubt: CommandDoubt) -> Floats:
        """Return the gain of log likelihood, nats, by each option, (k, options).

        A cart that hardly moves says nothing: dry friction holds it. Nor does a stretch that ends
        before the command acts.

        command: (n,) with the chosen options of the doubt.
        """
        left, per_drive = self.explain(command)
        usable = np.zeros(len(command))
        usable[self.rows] = left
        jumps = correlate1d(usable, _make_filter(), mode="constant")
        moving = np.abs(jumps[self.rows[~self.slow[self.rows]]])
        noise = _measure_noise(moving) or np.inf
        answering = np.minimum(doubt.samples + self.late, len(command) - 1)
        acting = find_earlier_samples(answering, self.late, self.stretch_begins)
        silent = self.slow[doubt.samples] | (acting != doubt.samples)
        jumps = jumps[answering]
        driven = self.drive.answer(doubt.values.ravel()).reshape(doubt.values.shape)
        lacking = per_drive * (driven - self.drive.answer(command[doubt.samples])[:, None])
        gains: Floats = lacking * (2 * jumps[:, None] - lacking) / (2 * noise**2)
        return np.where(silent[:, None], 0.0, gains)


def _make_balance(signals: Signals, state: SmoothState) -> Balance:
    assert signals.cart is not None
    rows = _list_rows(signals)
    basis = orth(list_other_forces(signals, state, 1)[rows])
    target = _take_out(basis, differentiate_twice(signals.cart, signals.period_s, 1)[rows])
    drive = fit_drive_curve(signals.command, make_second_differences(signals, state))
    latest = round(decisions.ANSWER_LATEST_S / signals.period_s)
    slow = _find_slow(state)
    begins = signals.stretch_begins
    balances = [
        Balance(rows, basis, target, drive, late, slow, begins) for late in range(latest + 1)
    ]
    return max(balances, key=lambda balance: balance.measure(signals.command))


def _take_out(basis: Floats, values: Floats) -> Floats:
    """Return values (rows,) without what an orthonormal basis (rows, columns) explains."""
    return values - basis @ (basis.T @ values)


def _measure_noise(sizes: Floats) -> float:
    """Return the standard deviation of the normal errors that are as large; 0 without any.

    sizes: (k,) magnitudes; where the forces are incomplete, a few are far larger than the median
        says.
    """
    if not len(sizes):
        return 0.0
    return max(float(np.quantile(sizes, at)) / size for at, size in QUANTILES_OF_NORMAL)


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

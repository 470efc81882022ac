"""The balance of forces and torques along a recording: what the motion needs beyond the twin.

Acceleration is known only smoothed. So every term of an equation, known or in question, goes
through the same filter as the acceleration: a force that jumps is compared with what smoothing
makes of a jump, and no edge of it looks like missing physics (the weak form of an equation;
Messenger and Bortz, Multiscale Model. Simul. 19 (2021) 1474).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.sieve import FORCE, TORQUE, Sieve, make_sieve
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.inverse_dynamics import compute_masses, compute_missing_force
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    FORCE_PER_PWM,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
)
from pendulum_twin.sensors import undo_sensors
from pendulum_twin.signals import Signals

FOLDS = 4
# The constants of the twin that stand in each equation: a missing force may have bent them, and
# they are fitted along with it.
REFITTED_CONSTANTS = (
    {"drive": (FORCE_PER_PWM,), "viscous": (CART_VISCOUS,), "coupling": (COUPLING,)},
    {"weight": (COUPLING, MOMENT), "viscous": (POLE_VISCOUS,)},
)


@dataclass(frozen=True)
class Motion:
    """Hold the motion that questions are about, (n,) each.

    Accelerations are those that the twin gives the state: the measured accelerations hold the same
    noise as the missing force.

    x, th, v, w: true states of cart and pole; m, rad, m/s, rad/s.
    a, b: accelerations of cart and pole; m/s^2, rad/s^2.
    u: what drives the cart, as a command.
    t: time, s from the recording's start.
    """

    x: Floats
    th: Floats
    v: Floats
    w: Floats
    a: Floats
    b: Floats
    u: Floats
    t: Floats


@dataclass(frozen=True)
class Balance:
    """Hold one equation along a recording, every term through one sieve.

    equation: FORCE (N, on the cart) or TORQUE (N m, on the pole).
    sieve: the filter.
    lacking: (rows,) what the twin lacks.
    turned: (rows, k) what a constant of the twin, increased by 1, would add.
    names: of the columns of `turned`.
    noise: standard deviation of a row that the sensors cause.
    size: root mean square of mass (inertia) times acceleration.
    block: (rows,) number of each row's block.
    fold: (rows,) number of the part that is held out with it.
    seconds: (rows,) time, s.
    spacing_s: between two rows.
    """

    equation: int
    sieve: Sieve
    lacking: Floats
    turned: Floats
    names: tuple[str, ...]
    noise: float
    size: float
    block: Ints
    fold: Ints
    seconds: Floats
    spacing_s: float

    @property
    def unit(self) -> str:
        """Return the equation's unit."""
        return "N" if self.equation == FORCE else "N m"


def compute_motion(case: Case, theta: Floats) -> Motion:
    """Return the true states behind what was measured, seen through a twin's sensors."""
    signals, state = case.signals, case.state
    x, th, v, w = undo_sensors(state.states[None], theta[None], signals.clock_s)[0].T
    still = np.zeros((len(signals), 2))
    force, torque = compute_missing_force(signals, state.states, still, theta)[0].T
    coupling = theta[COUPLING] * np.cos(th)
    mass = compute_masses(signals, theta)
    determinant = mass * theta[INERTIA] - coupling**2
    a, b = (
        -(theta[INERTIA] * force + coupling * torque),
        -(mass * torque + coupling * force),
    )
    return Motion(
        x, th, v, w, a / determinant, b / determinant, _compute_drive(case, theta), signals.times_s
    )


def _compute_drive(case: Case, theta: Floats) -> Floats:
    """Return what the drive makes of the command at every sample, force per `force_per_pwm_n`."""
    if case.signals.cart is None:
        return case.signals.command
    more = theta.copy()
    more[FORCE_PER_PWM] += 1.0
    still = np.zeros((len(case.signals), 2))
    return compute_lacking(case, theta, still, FORCE) - compute_lacking(case, more, still, FORCE)


def make_balances(case: Case, theta: Floats) -> tuple[Balance, ...]:
    """Return the equations of the joints that are there, for a twin with this theta (SIZE,)."""
    both = (make_balance(case, theta, equation) for equation in (FORCE, TORQUE))
    return tuple(balance for balance in both if balance is not None)


def make_balance(case: Case, theta: Floats, equation: int) -> Balance | None:
    """Return one joint's equation for a twin; None without the joint, or with too few rows.

    theta: (SIZE,) of the twin.
    """
    values = case.signals.cart if equation == FORCE else case.signals.pole
    if values is None:
        return None
    sharp = compute_sharp_accelerations(case)
    raw = compute_lacking(case, theta, sharp, equation)
    inertia = theta[MASS] if equation == FORCE else theta[INERTIA]
    own = inertia * sharp[:, equation]
    sieve, noise = make_sieve(case, theta, own, equation)
    if len(sieve.at) < decisions.BALANCE_LEAST_ROWS:
        return None
    turned = {}
    for name, slots in REFITTED_CONSTANTS[equation].items():
        more = theta.copy()
        more[list(slots)] += 1.0
        column = sieve(raw - compute_lacking(case, more, sharp, equation))
        if np.any(column):
            turned[name] = column
    seconds = case.signals.times_s[sieve.at]
    block = _number_blocks(case, sieve.at)
    return Balance(
        equation, sieve, sieve(raw), np.stack(list(turned.values()), axis=1), tuple(turned), noise,
        float(np.sqrt(np.mean(sieve(own) ** 2))), block, _deal_folds(block), seconds,
        int(np.min(np.diff(sieve.at))) * case.signals.period_s,
    )  # fmt: skip


def compute_sharp_accelerations(case: Case) -> Floats:
    """Return accelerations (n, 2) by second differences: noisy, for the sieve to smooth.

    Of a force that is held from sample to sample they are the mean of the periods before and
    after, without error.
    """
    signals = case.signals
    accelerations = np.zeros((len(signals), 2))
    for k, values in enumerate((signals.cart, signals.pole)):
        if values is not None:
            accelerations[:, k] = differentiate(signals, values)[1]
    return accelerations


def differentiate(signals: Signals, values: Floats) -> tuple[Floats, Floats]:
    """Return the first and second derivative of values (n,) by central differences.

    Both are 0 at the ends of stretches.
    """
    first, second = np.zeros(len(values)), np.zeros(len(values))
    for s in signals.stretches:
        part = values[s]
        first[s][1:-1] = (part[2:] - part[:-2]) / (2 * signals.period_s)
        second[s][1:-1] = np.diff(part, 2) / signals.period_s**2
    return first, second


def compute_lacking(case: Case, theta: Floats, sharp: Floats, equation: int) -> Floats:
    """Return the force (N) or torque (N m) that a twin lacks at every sample, (n,), unsmoothed."""
    return compute_missing_force(case.signals, case.state.states, sharp, theta)[0][:, equation]


def _number_blocks(case: Case, at: Ints) -> Ints:
    """Return the number of each row's block; no block reaches over two stretches."""
    signals = case.signals
    stretch = np.searchsorted(signals.stretch_begins, at, side="right") - 1
    inside = (
        (at - np.array(signals.stretch_begins)[stretch])
        * signals.period_s
        // decisions.ERROR_BLOCK_S
    ).astype(np.int64)
    return np.unique(np.stack([stretch, inside]), axis=1, return_inverse=True)[1].reshape(-1)


def _deal_folds(block: Ints) -> Ints:
    """Return which fold each row belongs to.

    Blocks are dealt at random, lest a periodic command favour a fold.
    """
    random = np.random.default_rng(0)
    dealt = random.permutation(np.arange(int(block.max()) + 1) % FOLDS)
    return dealt[block]

"""How a cart answers pushes: how late, how strongly, and up to which command.

Only the drive and the cart's friction move the centre of mass of cart and pole (see
`safety.rail_guard`). Its second differences over 4 samples are means, with triangular weights, of
gain (u - dead sign u) - friction over mass, where u is the delayed and lagged command. For each
delay and lag, gain, dead zone, dry friction and bias are a linear fit; the best fit is taken. The
effect of a command near the limit is then measured by that of smaller commands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor.directions import solve_least_squares
from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.held_signal import HeldSignal
from pendulum_bridge.doctor.resting import CART, POLE
from pendulum_bridge.doctor.track import Grid, Track, compute_slopes
from pendulum_twin.arrays import Floats
from pendulum_twin.rig import Rig

HALF_BASE_SAMPLES = 2  # half the length of a second difference
SLOW_M_S = 0.02  # a slower cart may stick
STEP_WINDOW_S = (0.02, 0.06)  # before and after a step of the command: its own motion
LEAST_STEP_SHARE = 0.5  # of the largest small step; a smaller step shows its time badly
FEWEST_STEPS = 3  # for a spread; and samples about a step
LONGEST_DELAY_S, DELAY_STEP_S = 0.2, 0.0025  # of the delays tried
LAGS_S = (0.0, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1)
LEAST_PUSH_SHARE = 0.3  # of a push, within a second difference that counts
GUARD_LATENCY_S = 0.02  # that the rail guard assumes
LARGEST_GAIN_DEVIATION = 0.15  # of the gain; with a larger deviation it says nothing
CLOSE_GAIN_FACTOR = 1.25  # within which the gain is as the twin file has it
CLIPPED_SHARE = 0.85  # of a command; with less effect it is clipped


@dataclass(frozen=True)
class Response:
    """Hold how the cart answers.

    latency_s: from a sample to the motion that the answer to it makes, the drive's lag included.
    latencies_s: (k,) the same of each step of the small commands; empty when unknown.
    gain: m/s^2 a unit of command, along the measured cart.
    deviation: standard deviation of the gain.
    strongest: the largest command that was sent, PWM fraction.
    effect: the command without a limit that would have had the same effect; None when unknown.
    """

    latency_s: float
    gain: float
    deviation: float
    strongest: float
    effect: float | None
    latencies_s: tuple[float, ...] = ()

    @property
    def spread_s(self) -> float | None:
        """Return the standard deviation of the latencies from step to step, s; None if unknown.

        It holds the scatter of the measurement, too, so the true spread is not larger.
        """
        if len(self.latencies_s) < FEWEST_STEPS:
            return None
        return float(np.std(self.latencies_s, ddof=1))

    @property
    def is_sure(self) -> bool:
        """Return whether the gain was measured well enough to judge."""
        return self.deviation < LARGEST_GAIN_DEVIATION * abs(self.gain)


def measure_response(track: Track, grid: Grid, rig: Rig, pole_way: int, small: float) -> Response:
    """Return the response; small commands give the gain, the large commands after them the limit.

    pole_way: +1, or -1 where the angle counts clockwise.
    small: largest size of a small command, PWM fraction.
    """
    motion = _Motion(track, grid, rig, pole_way, small)
    fits = [motion.fit_delay(lag_s) for lag_s in LAGS_S]
    best = min(fits, key=lambda fit: fit.residual)
    strongest = float(np.max(np.abs(track.sent), initial=0.0))
    gain, deviation = float(best.factors[0]), float(best.deviations[0])
    return Response(
        best.delay_s + best.lag_s,
        gain,
        deviation,
        strongest,
        motion.measure_effect(best),
        motion.measure_latencies(best),
    )


def check_latency(response: Response, period_s: float) -> Finding:
    """Return whether commands act within the guard's latency and half a period."""
    expected = f"at most {1e3 * GUARD_LATENCY_S:g} ms from a command to the cart's motion"
    if not response.is_sure:
        return skip_check(Check.LATENCY, "the motion was too small or too disturbed to tell")
    slow = response.latency_s > GUARD_LATENCY_S + 0.5 * period_s
    observed, figures = f"{1e3 * response.latency_s:.0f} ms", {"mean_s": response.latency_s}
    if response.spread_s is not None:
        observed += f" (+-{1e3 * response.spread_s:.1f} ms from step to step)"
        figures |= {"spread_s": response.spread_s, "steps": len(response.latencies_s)}
    fault = Fault.SLOW_ANSWER if slow else None
    return Finding(Check.LATENCY, expected, observed, fault, figures=figures)


def check_acceleration(response: Response, expected: float, least: float, most: float) -> Finding:
    """Return whether the gain (m/s^2 a unit of command) is that of the twin file.

    expected: by the twin file.
    least, most: between which the rail guard works.
    """
    if not response.is_sure:
        return skip_check(Check.ACCELERATION, "the motion was too small or too disturbed to tell")
    gain = abs(response.gain)
    fault = None if 1 / CLOSE_GAIN_FACTOR < gain / expected < CLOSE_GAIN_FACTOR else Fault.GAIN_OFF
    if not least < gain < most:
        fault = Fault.GAIN_UNSAFE
    observed = f"{gain:.1f} (+-{response.deviation:.1f}), {gain / expected:.2f} times that"
    return Finding(Check.ACCELERATION, f"{expected:.1f} m/s^2 for a command of 1", observed, fault)


def check_clipping(response: Response, limit: float) -> Finding:
    """Return whether commands up to the limit (PWM fraction) act in full."""
    expected = f"commands up to {limit:g} to act in full"
    if response.effect is None or not response.is_sure:
        return skip_check(
            Check.CLIPPING, "no command near the limit was sent, or the motion did not tell"
        )
    observed = f"{response.strongest:.2f} acts like {response.effect:.2f}"
    return Finding(
        Check.CLIPPING,
        expected,
        observed,
        Fault.CLIPPED if response.effect < CLIPPED_SHARE * limit else None,
    )


@dataclass(frozen=True)
class _Fit:
    """Hold the fit for a delay and a lag.

    factors: (4,) gain, gain times dead zone, dry friction, bias.
    deviations: (4,) standard deviations of the factors.
    residual: mean square.
    """

    delay_s: float
    lag_s: float
    factors: Floats
    deviations: Floats
    residual: float


class _Motion:
    """The second differences of a track's centre of mass, and the terms that explain them."""

    def __init__(self, track: Track, grid: Grid, rig: Rig, pole_way: int, small: float) -> None:
        self._track, self._times, self._period_s = (
            track,
            grid.times[HALF_BASE_SAMPLES:-HALF_BASE_SAMPLES],
            grid.period_s,
        )
        cart = grid.samples[:, CART]
        centre = cart - pole_way * (rig.com_distance_m or 0.0) * np.sin(grid.samples[:, POLE])
        second = (
            centre[2 * HALF_BASE_SAMPLES :]
            - 2 * centre[HALF_BASE_SAMPLES:-HALF_BASE_SAMPLES]
            + centre[: -2 * HALF_BASE_SAMPLES]
        ) / (HALF_BASE_SAMPLES * grid.period_s) ** 2
        speed = compute_slopes(cart, grid.period_s, HALF_BASE_SAMPLES)
        self._changes = second + (rig.cart_viscous_n_s_m or 0.0) / rig.total_mass_kg * speed
        self._moving, self._dry = np.abs(speed) > SLOW_M_S, -np.sign(speed)
        self._large = np.abs(track.sent) > small
        self._end_s = (
            float(np.min(track.sent_at[self._large], initial=np.inf))
            - HALF_BASE_SAMPLES * grid.period_s
        )

    def fit_delay(self, lag_s: float) -> _Fit:
        """Return the best fit of the small commands for a lag, over all delays."""
        signals = self._hold(self._track.sent, lag_s), self._hold(np.sign(self._track.sent), lag_s)
        delays = np.arange(0.0, LONGEST_DELAY_S, DELAY_STEP_S).tolist()
        return min(
            (self._fit(delay_s, lag_s, signals) for delay_s in delays),
            key=lambda fit: fit.residual,
        )

    def measure_effect(self, best: _Fit) -> float | None:
        """Return the unlimited command (PWM fraction) that has the large commands' effect."""
        times, sent = self._times - best.delay_s, self._track.sent
        share = self._hold(np.where(self._large, np.sign(sent), 0.0), best.lag_s).average_around(
            times
        )
        chosen = self._moving & (np.abs(share) > LEAST_PUSH_SHARE)
        if chosen.sum() < 2 or not best.factors[0]:
            return None
        small = self._hold(np.where(self._large, 0.0, sent), best.lag_s)
        others = self._stack_terms(times, small, self._hold(np.sign(sent), best.lag_s))
        unexplained = (self._changes - others @ best.factors)[chosen] / best.factors[0]
        return float(unexplained @ share[chosen] / (share[chosen] @ share[chosen]))

    def measure_latencies(self, best: _Fit) -> tuple[float, ...]:
        """Return the latency of each step of the small commands, lag included, s.

        Gain and friction are those of the best fit; a step's own motion gives its delay.
        """
        sent_at, sent = self._track.sent_at, self._track.sent
        steps = np.abs(np.diff(sent, prepend=0.0))
        counted = steps[sent_at < self._end_s]
        if not np.isfinite(best.residual) or not len(counted) or not np.max(counted):
            return ()
        at_s = sent_at[(steps >= LEAST_STEP_SHARE * np.max(counted)) & (sent_at < self._end_s)]
        delays = np.arange(0.0, LONGEST_DELAY_S, 0.25 * DELAY_STEP_S)
        signals = self._hold(sent, best.lag_s), self._hold(np.sign(sent), best.lag_s)
        errors = np.array(
            [
                (self._changes - self._stack_terms(self._times - d, *signals) @ best.factors) ** 2
                for d in delays.tolist()
            ]
        )
        latencies = []
        for step_s in at_s.tolist():
            begin_s = step_s + best.delay_s
            chosen = (self._times > begin_s - STEP_WINDOW_S[0] - best.lag_s) & (
                self._times < begin_s + STEP_WINDOW_S[1] + best.lag_s
            )
            if not np.all(self._moving[chosen]) or chosen.sum() < FEWEST_STEPS:
                continue  # the cart sticks or turns: its friction hides the step
            at = int(np.argmin(errors[:, chosen].sum(axis=1)))
            if 0 < at < len(delays) - 1:
                latencies.append(float(delays[at]) + best.lag_s)
        return tuple(latencies)

    def _fit(self, delay_s: float, lag_s: float, signals: tuple[HeldSignal, HeldSignal]) -> _Fit:
        chosen = self._moving & (self._times < self._end_s)
        terms, changes = (
            self._stack_terms(self._times - delay_s, *signals)[chosen],
            self._changes[chosen],
        )
        if len(terms) <= terms.shape[1]:
            return _Fit(delay_s, lag_s, np.zeros(4), np.full(4, np.inf), np.inf)
        factors, deviations = solve_least_squares(terms, changes)
        return _Fit(
            delay_s, lag_s, factors, deviations, float(np.mean((changes - terms @ factors) ** 2))
        )

    def _stack_terms(self, times: Floats, command: HeldSignal, sign: HeldSignal) -> Floats:
        return np.stack(
            [
                command.average_around(times),
                -sign.average_around(times),
                self._dry,
                np.ones_like(times),
            ],
            axis=1,
        )

    def _hold(self, values: Floats, lag_s: float) -> HeldSignal:
        return HeldSignal(
            self._track.sent_at, values, lag_s, HALF_BASE_SAMPLES * self._period_s, self._period_s
        )

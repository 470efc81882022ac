"""The nouns of a diagnosis, on one page: what each stage takes and hands on."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.model import Twin
from pendulum_twin.signals import Signals


class Outcome(Enum):
    """How a diagnosis can end."""

    NAMED = "named"  # physics was left out, and the catalogue has it
    NOTHING_MISSING = "nothing_missing"  # other parameters are enough
    AMBIGUOUS = "ambiguous"  # physics was left out, and this recording cannot tell which
    NOT_IN_CATALOGUE = "not_in_catalogue"  # physics was left out that no effect explains
    UNUSABLE = "unusable"  # the recording cannot answer the question


type FaultKind = Literal[
    "spike",
    "gap",
    "jitter",
    "wrap",
    "stale",
    "clipped",
    "slip",
    "rail_end",
    "other_command",
    "late_command",
    "other_rate",
]


@dataclass(frozen=True)
class QualityFinding:
    """Say what is wrong with the data of a recording.

    Attributes:
        kind: spike, gap, jitter, wrap, stale, clipped, slip, rail_end, other_command,
            late_command or other_rate.
        count: how many there are.
        intervals_s: where, in s from the first sample.
        note: what the kind alone does not say, in words; empty for nothing.
    """

    kind: FaultKind
    count: int
    intervals_s: tuple[tuple[float, float], ...] = ()
    note: str = ""


@dataclass(frozen=True)
class CommandLatency:
    """Hold how late commands act, as `rig_doctor --move` measured it on the rig.

    mean_s: s, from a command to the motion that it makes, the drive's lag included.
    spread_s: s, standard deviation from step to step, the scatter of the measurement included;
        None where the doctor could not tell.
    """

    mean_s: float
    spread_s: float | None = None


@dataclass(frozen=True)
class Recording:
    """Hold one recording as it was read and cleaned.

    Attributes:
        name: for titles.
        digest: "sha256:..." over the bytes of the files.
        signals: command and positions on one clock.
        findings: faults that the cleaning met.
        rates: (n, 2) reported velocities of cart (m/s) and pole (rad/s), NaN where none was
            reported; None for a recording without velocities.
        timing_spread_s: s, by which the times of commands against samples are unknown; a delay
            is known no better.
        command_latency: how late commands act; None where the recording does not say.
        doubt: samples whose command is in doubt; None where there are none.
        at_once: (n,) PWM fraction, the command if each message acts when it comes: its mean over
            the period after each sample; None where `signals` hold the same.
        pole_step_rad: rad, step of the pole's encoder, of which the angles are whole multiples as
            they were recorded; 0 where none shows. On uneven times `signals` lie between steps.
    """

    name: str
    digest: str
    signals: Signals
    findings: tuple[QualityFinding, ...] = ()
    rates: Floats | None = None
    timing_spread_s: float = 0.0
    command_latency: CommandLatency | None = None
    doubt: CommandDoubt | None = None
    at_once: Floats | None = None
    pole_step_rad: float = 0.0

    @property
    def losses(self) -> str:
        """Return what the file is known to have lost, in words; empty for a whole file."""
        return "; ".join(f.note for f in self.findings if f.kind == "gap" and f.note)

    @staticmethod
    def from_arrays(
        t: ArrayLike,
        command: ArrayLike | None,
        cart: ArrayLike | None,
        pole: ArrayLike | None,
        name: str = "arrays",
    ) -> Recording:
        """Make a recording from arrays or pandas series, and clean it.

        Args:
            t: (n,) s, sampling times, rising.
            command: (n,) PWM fraction; None for a pole alone that nothing drives.
            cart: (n,) m, positive along the rail, 0 in the middle; None where it is not recorded.
            pole: (n,) rad, 0 upright, counterclockwise positive; None where it is not recorded.
            name: for titles.

        Returns:
            The recording on one uniform clock, and the faults in its data.

        Raises:
            BadInputError: times do not rise or are not finite, shapes differ, an array holds
                anything but numbers, or too few samples are finite.

        Examples:
            >>> swing = ps.Recording.from_arrays(t, command, None, run.pole + noise[:, 1])
            >>> swing.signals.cart is None
            True
        """
        from pendulum_sysid.api import make_recording

        return make_recording(t, command, cart, pole, name)


@dataclass(frozen=True)
class Noise:
    """Hold the standard deviation of each sensor's noise, the steps of its encoder included.

    Attributes:
        cart_m: m; None for a recording without a cart.
        pole_rad: rad; None for a recording without a pole.
    """

    cart_m: float | None
    pole_rad: float | None


@dataclass(frozen=True)
class Windows:
    """Hold windows of equal length, each to be run freely from its own start state.

    Attributes:
        begin: (windows,) first sample of each window.
        samples: samples in a window, first and last included.
        start_states: (windows, 4) measured x (m), th (rad), v (m/s), w (rad/s) at the first
            sample, smoothed out of the recording alone.
    """

    begin: Ints
    samples: int
    start_states: Floats

    def pick(self, chosen: Ints | Mask) -> Windows:
        """Return the windows at the chosen indices."""
        return Windows(self.begin[chosen], self.samples, self.start_states[chosen])

    def __len__(self) -> int:
        return len(self.begin)


@dataclass(frozen=True)
class Split:
    """Hold the windows of a recording in three groups.

    The search fits `train` and `choose` together (`learn`) and compares hypotheses by
    cross-validation over both. No fit and no choice sees `held_out`. Rivals of the proof that
    need windows to choose on apart from those of the fit keep the first two apart.

    Attributes:
        train: windows to fit on, half of all.
        choose: windows to fit and to choose on, a quarter.
        held_out: windows to judge on, a quarter.
    """

    train: Windows
    choose: Windows
    held_out: Windows

    @property
    def learn(self) -> Windows:
        """Return the windows to fit on and to choose on as one group, in order of time."""
        begin = np.concatenate([self.train.begin, self.choose.begin])
        starts = np.concatenate([self.train.start_states, self.choose.start_states])
        order = np.argsort(begin, kind="stable")
        return Windows(begin[order], self.train.samples, starts[order])


@dataclass(frozen=True)
class Estimate:
    """Hold a fitted value with its 95 % interval, in the unit of its parameter.

    Attributes:
        value: the estimate.
        low, high: ends of the interval.
        identifiable: False where the recording does not fix the value.
        at_bound: True where the fit ended at the end of the allowed range.
    """

    value: float
    low: float
    high: float
    identifiable: bool = True
    at_bound: bool = False


@dataclass(frozen=True)
class Fit:
    """Hold the result of a fit: the twin, and how well it runs.

    Attributes:
        twin: the fitted twin.
        effects: names of its effects, those of the given twin first.
        estimates: parameter ("cart_viscous_n_s_m", "cart_coulomb_friction.level_n") -> estimate.
        theta: (SIZE,) parameter vector of the twin.
        start_states: (windows, 4) refined start states.
        power: (channels,) mean squared error of the windows, m^2 or rad^2.
        train, choose: misfit of the windows, fitted to all of them and cross-validated: the
            geometric mean over channels of the root mean square error in units of sensor noise.
        window_squares: (windows, channels) sum of squared errors of each window, cross-validated.
        counts: (windows, channels) valid samples of each window.
        noise: (channels,) standard deviation of the sensors' noise, m or rad.
        pieces: into how many pieces each window was cut for this fit (its horizon).
        converged: whether the iteration reached its tolerance.
        correlations: (free, free) of the errors of the first estimates, -1 to 1, NaN for what is
            not fixed; empty where nobody asked.
    """

    twin: Twin
    effects: tuple[str, ...]
    estimates: dict[str, Estimate]
    theta: Floats
    start_states: Floats
    power: Floats
    train: float
    choose: float
    window_squares: Floats
    counts: Floats
    noise: Floats
    pieces: int = 1
    converged: bool = True
    correlations: Floats = field(default_factory=lambda: np.empty((0, 0)))


@dataclass(frozen=True)
class Trial:
    """Hold one row of the report's table: a set of effects and how well it did.

    Attributes:
        effects: the set.
        train, choose: misfit of the windows, fitted and cross-validated.
        verdict: what became of the set, in words.
    """

    effects: tuple[str, ...]
    train: float
    choose: float
    verdict: str


@dataclass(frozen=True)
class Evidence:
    """Say what the missing force or torque goes with, and the measured shape.

    Attributes:
        variable: the variable; a product is written with a star.
        finding: the shape in words.
        share: share of the missing power that goes with the variable, 0 to 1; a relation, from
            which the place of the physics need not follow.
        shape_x: (points,) places on the axis; empty where the answer is a single number.
        shape_y: (points,) measured values there.
        shape_band: (points,) half widths of their 95 % intervals.
        shape_axis: the variable of the axis.
        shape_of, shape_unit: the quantity that is drawn, and its unit.
        place: the place of the chain that this evidence points to.
    """

    variable: str
    finding: str
    share: float
    shape_x: Floats = field(default_factory=lambda: np.empty(0))
    shape_y: Floats = field(default_factory=lambda: np.empty(0))
    shape_band: Floats = field(default_factory=lambda: np.empty(0))
    shape_axis: str = ""
    shape_of: str = ""
    shape_unit: str = ""
    place: str = ""


@dataclass(frozen=True)
class Localisation:
    """Say where a mismatch lives.

    Attributes:
        place: command, drive, cart, pole, sensor or clock.
        evidence: the variables it depends on, the largest share first.
        intervals_s: stretches of the recording where it is largest, s.
        explained: share (0 to 1) of the missing power that goes with all that was asked, told or
            not.
    """

    place: str
    evidence: tuple[Evidence, ...]
    intervals_s: tuple[tuple[float, float], ...] = ()
    explained: float = 0.0


@dataclass(frozen=True)
class Comparison:
    """Hold how a twin runs on windows of a recording (`sysid replay`).

    Attributes:
        seconds: length of a window, s.
        count: number of windows.
        cart_rmse_m: root mean square error of the cart, m; None without a cart.
        pole_rmse_rad: root mean square error of the pole, rad; None without a pole.
        score: root mean square of both errors, each in units of its sensor's noise.
        noise_floor: the score that the twin would reach if it were perfect; None where its runs
            diverge.
        thesis_rmse: equation 29 of the thesis over one free run of the whole recording.
    """

    seconds: float
    count: int
    cart_rmse_m: float | None
    pole_rmse_rad: float | None
    score: float
    noise_floor: float | None
    thesis_rmse: float


@dataclass(frozen=True)
class Overlay:
    """Hold free runs of two twins over held-out windows beside the measurement, for a picture.

    Attributes:
        channel: "cart" or "pole".
        unit: "m" or "rad".
        times_s: (windows, n) s from the start of the recording.
        measured: (windows, n) the measurement; NaN for a sample that is missing.
        before, after: (windows, n) both twins' runs.
    """

    channel: str
    unit: str
    times_s: Floats
    measured: Floats
    before: Floats
    after: Floats


@dataclass(frozen=True)
class Next:
    """Hold the plan of the next experiment, and why.

    Attributes:
        plan: as `pendulum_plan/1` has it; None where no experiment would tell more.
        why: the reason, for a person.
        before, after: of the worst-served aim: standard errors between inseparable twins, or the
            half width of an interval, now and expected with the plan's recording; None without a
            plan.
    """

    plan: dict[str, Any] | None
    why: str
    before: float | None = None
    after: float | None = None

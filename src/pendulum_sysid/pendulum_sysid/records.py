"""The nouns of a diagnosis, on one page: what each stage takes and hands on."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.signals import Signals

Ints = NDArray[np.int64]


class Outcome(Enum):
    """How a diagnosis can end."""

    NAMED = "named"  # physics was left out, and the catalogue has it
    NOTHING_MISSING = "nothing_missing"  # other parameters are enough
    AMBIGUOUS = "ambiguous"  # physics was left out, and this recording cannot tell which
    NOT_IN_CATALOGUE = "not_in_catalogue"  # physics was left out that no effect explains
    UNUSABLE = "unusable"  # the recording cannot answer the question


@dataclass(frozen=True)
class QualityFinding:
    """Say what is wrong with a recording's data: kind, how often, and where (s from its start)."""

    kind: str  # spike | gap | jitter | wrap | stale | clipped
    count: int
    intervals_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Recording:
    """Hold one recording as read and cleaned.

    name: for titles. digest: "sha256:..." of the files. signals: on one clock. findings: what the
    cleaning met.
    rates: (n, 2) velocities of cart (m/s) and pole (rad/s) as they were reported, NaN where they
    were not; None for none.
    """

    name: str
    digest: str
    signals: Signals
    findings: tuple[QualityFinding, ...] = ()
    rates: Floats | None = None

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
            BadInputError: times do not rise, lengths differ, or too few samples are finite.

        Examples:
            >>> swing = ps.Recording.from_arrays(t, command, None, run.pole + noise[:, 1])
            >>> swing.signals.cart is None
            True
        """
        from pendulum_sysid.api import make_recording

        return make_recording(t, command, cart, pole, name)


@dataclass(frozen=True)
class Noise:
    """Hold the standard deviation of each sensor's noise, encoder steps included; None for a sensor not there."""

    cart_m: float | None
    pole_rad: float | None


@dataclass(frozen=True)
class Windows:
    """Hold stretches of equal length, each to be run freely from its own start.

    begin: (windows,) first sample. samples: samples in each, start and end included. starts:
    (windows, 4) measured x, th, v, w at the start, smoothed out of the recording alone.
    """

    begin: Ints
    samples: int
    starts: Floats

    def pick(self, chosen: NDArray) -> Windows:
        """Return the windows at the chosen indices."""
        return Windows(self.begin[chosen], self.samples, self.starts[chosen])

    def __len__(self) -> int:
        return len(self.begin)


@dataclass(frozen=True)
class Split:
    """Hold the three parts that are kept strictly apart: to fit on, to choose between hypotheses, to judge."""

    train: Windows
    choose: Windows
    held_out: Windows


@dataclass(frozen=True)
class Estimate:
    """Hold a fitted value with its 95 % interval; identifiable is False where the recording does not fix it."""

    value: float
    low: float
    high: float
    identifiable: bool = True
    at_bound: bool = False


@dataclass(frozen=True)
class Fit:
    """Hold what a fit came to: the twin, and how well it runs.

    estimates: parameter's name ("cart_viscous_n_s_m", "cart_coulomb_friction.level_n") ->
    estimate.
    theta: (SIZE,) the twin as words. starts: (training windows, 4) their refined start states.
    power: (channels,) mean squared errors in training. train, choose: misfit in each part, the
    geometric mean over channels of the root mean square error in units of the sensor's noise, each
    window's start refined.
    window_squares, counts: (choosing windows, channels) squared errors and samples of each window.
    noise: (channels,).
    parts: into how many parts every window was cut for this fit.
    """

    twin: Twin
    effects: tuple[str, ...]
    estimates: dict[str, Estimate]
    theta: Floats
    starts: Floats
    power: Floats
    train: float
    choose: float
    window_squares: Floats
    counts: Floats
    noise: Floats
    parts: int = 1
    converged: bool = True


@dataclass(frozen=True)
class Trial:
    """Say how one set of effects did while the diagnosis grew: a row of the report's table."""

    effects: tuple[str, ...]
    train: float
    choose: float
    verdict: str


@dataclass(frozen=True)
class Evidence:
    """Say what the unexplained motion depends on: a variable (a product with a star), its share, and the measured shape.

    shape_x, shape_y, shape_band: (points,) where on the axis, how much, and the half width of a 95
    % interval; empty where the answer is a single number. shape_axis: the variable drawn along.
    shape_of, shape_unit: what is drawn. place: where this evidence by itself points to.
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
    """Say where a mismatch lives: place of the chain, evidence by share, stretches of the recording (s)."""

    place: str
    evidence: tuple[Evidence, ...]
    intervals_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Comparison:
    """Hold how one twin runs on windows of a recording (contract: `sysid replay`)."""

    seconds: float
    count: int
    cart_rmse_m: float | None
    pole_rmse_rad: float | None
    score: float
    thesis_rmse: float


@dataclass(frozen=True)
class Overlay:
    """Hold free runs of two twins over held-out windows beside what was measured, for a picture.

    channel: "cart" or "pole". unit: "m" or "rad". times_s: (windows, n) from the recording's
    start. measured, before,
    after: (windows, n).
    """

    channel: str
    unit: str
    times_s: Floats
    measured: Floats
    before: Floats
    after: Floats


@dataclass(frozen=True)
class Next:
    """Hold the plan of the next experiment, None where none would help, and why, for a person.

    plan: as `pendulum_plan/1` has it. before, after: of the worst-served aim, standard errors
    between tied twins or the half width of an interval, now and as expected with the plan's
    recording; None where there is no plan.
    """

    plan: dict | None
    why: str
    before: float | None = None
    after: float | None = None

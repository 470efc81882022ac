"""The thesis's own way to fit its twin: Nelder-Mead over twelve parameters on one record.

One number (equation 29 over a single free run) is made small with no derivatives, nothing held out
and no intervals. Starts, bounds and tolerance are those of the published script:
github.com/Senerader/TalTechMasters2022, MATLAB_Snippets/optimizer_pendulum.m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.whole_run import compute_equation_29, run_whole
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.pole_body import check_pole_body
from pendulum_twin.rig import RANGES, UNITS

MOST_EVALUATIONS = 2000
FRICTION_LIMIT_N = 1.0  # where the thesis's simulation clips its cart friction
X_TOLERANCE, COST_TOLERANCE = 1e-7, 1e-4  # the script's TolX, and MATLAB's own for the value
DIVERGED = (
    1e6  # cost of a run that left all bounds; the search compares costs, so it must be a number
)
AT_BOUND = 1e-6  # of the range
REPORT_EVERY = 200
SIGNS = tuple(effect.name for effect in CATALOGUE if effect.is_switch)
FRICTION, DEAD_ZONES = "cart_saturating_friction", "thesis_dead_zones"


@dataclass(frozen=True)
class Searched:
    """Describe one of the twelve parameters.

    name: in the twin; of an effect's parameter, after the name of the effect.
    high: highest value; the lowest is 0, or just above where the twin needs it.
    start: None where the twin's own value is taken.
    """

    name: str
    high: float
    start: float | None = None

    @property
    def low(self) -> float:
        """Return the lowest value."""
        return RANGES[self.name][0] if self.name in RANGES else 0.0

    @property
    def unit(self) -> str:
        """Return the unit."""
        if self.name in UNITS:
            return UNITS[self.name]
        effect, parameter = self.name.split(".")
        return next(p.unit for p in BY_NAME[effect].parameters if p.name == parameter)


SEARCHED: tuple[Searched, ...] = (
    Searched("cart_mass_kg", 1.0),
    Searched("pole_mass_kg", 1.0),
    Searched("pole_viscous_n_m_s", 0.01),
    Searched(f"{FRICTION}.viscous_n_s_m", 2.0, 1.1975875),
    Searched(f"{FRICTION}.level_n", 1.5, 0.5),
    Searched("com_distance_m", 0.1),
    Searched("pole_inertia_kg_m2", 0.01),
    Searched("gravity_m_s2", 15.0),
    Searched("force_per_pwm_n", 13.0),
    Searched(f"{DEAD_ZONES}.force_n", 2.0, 0.093125),
    Searched(f"{DEAD_ZONES}.cart_velocity_m_s", 1.0, 0.1),
    Searched(f"{DEAD_ZONES}.pole_velocity_rad_s", 3.0, 1.5),
)


@dataclass(frozen=True)
class Moved:
    """Say where one parameter started and ended."""

    name: str
    unit: str
    start: float
    fitted: float
    at_bound: bool

    @property
    def percent(self) -> float | None:
        """Return how far it moved, in percent of its start; None when that is 0."""
        return 100.0 * (self.fitted / self.start - 1.0) if self.start else None


@dataclass(frozen=True)
class ThesisFit:
    """Hold what the search came to.

    before, after: equation 29 on the record that was fitted.
    dropped: effects, and then measured laws, of the given twin that the thesis's model does not
        have.
    """

    twin: Twin
    moved: tuple[Moved, ...]
    before: float
    after: float
    evaluations: int
    converged: bool
    dropped: tuple[str, ...]


def fit_as_thesis(
    case: Case,
    progress: Callable[[str], None],
    most_evaluations: int = MOST_EVALUATIONS,
) -> ThesisFit:
    """Find the twin by the thesis's procedure on a recording of cart and pole.

    Starts from the constants of the case's twin and the script's friction and dead zones. Inverted
    signs of the given twin are kept; its other effects, its measured laws and its viscous cart
    friction make way for the thesis's. Raises WrongUse when cart or pole is missing, or a constant
    is beyond the script's bounds.
    """
    start = _start(case.twin)
    search = _Search(case, progress)
    before = search.cost(start)
    result = minimize(
        search.cost,
        start,
        method="Nelder-Mead",
        bounds=[(searched.low, searched.high) for searched in SEARCHED],
        options={
            "maxfev": most_evaluations,
            "maxiter": np.inf,
            "xatol": X_TOLERANCE,
            "fatol": COST_TOLERANCE,
        },
    )
    return ThesisFit(
        twin=_make_twin(case.twin, result.x),
        moved=tuple(
            _describe_move(*three) for three in zip(SEARCHED, start, result.x, strict=True)
        ),
        before=before,
        after=float(result.fun),
        evaluations=int(result.nfev),
        converged=bool(result.success),
        dropped=tuple(
            name
            for name in (*case.twin.effects, *case.twin.measured_laws)
            if name not in (*SIGNS, FRICTION, DEAD_ZONES)
        ),
    )


class _Search:
    """Count the evaluations of the cost and say now and then how far the search is."""

    def __init__(self, case: Case, progress: Callable[[str], None]) -> None:
        self._case, self._progress = case, progress
        self._count, self._best = 0, np.inf

    def cost(self, values: Floats) -> float:
        """Return equation 29 of the twin with these twelve values; high where none exists."""
        error = self._replay(values)
        self._count, self._best = self._count + 1, min(self._best, error)
        if self._count % REPORT_EVERY == 0:
            self._progress(f"{self._count} evaluations, equation 29 down to {self._best:.4g}")
        return min(error, DIVERGED)

    def _replay(self, values: Floats) -> float:
        try:
            twin = _make_twin(self._case.twin, values)
            check_pole_body(twin.rig)
        except BadInputError:  # a simplex may leave the region in which bodies exist
            return DIVERGED
        signals, states = self._case.signals, self._case.state.states
        return compute_equation_29(signals, run_whole(signals, states, make_theta(twin)))


def _start(twin: Twin) -> Floats:
    if not (twin.rig.has_cart and twin.rig.has_pole):
        missing = "pole" if twin.rig.has_cart else "cart"
        raise WrongUse(
            f"expected a recording of cart and pole, found no {missing}: the thesis's procedure "
            "needs both, use --method windows"
        )
    start = np.array(
        [
            getattr(twin.rig, searched.name) if searched.start is None else searched.start
            for searched in SEARCHED
        ]
    )
    for searched, value in zip(SEARCHED, start, strict=True):
        if not searched.low <= value <= searched.high:
            raise WrongUse(
                f"expected {searched.name} from {searched.low:g} to {searched.high:g} "
                f"{searched.unit}, found {value:g}: the thesis's bounds are for its own rig, "
                "use --method windows"
            )
    return start


def _make_twin(base: Twin, values: Floats) -> Twin:
    """Return the base's twin with the thesis's model in it and these twelve values."""
    given = {searched.name: float(value) for searched, value in zip(SEARCHED, values, strict=True)}
    rig = {name: value for name, value in given.items() if name in RANGES}
    signs = {name: values for name, values in base.effects.items() if name in SIGNS}
    friction = {**_pick_effect(FRICTION, given), "limit_n": FRICTION_LIMIT_N}
    return Twin(
        base.name,
        replace(base.rig, **rig, cart_viscous_n_s_m=0.0),
        {**signs, FRICTION: friction, DEAD_ZONES: _pick_effect(DEAD_ZONES, given)},
    )


def _pick_effect(effect: str, given: dict[str, float]) -> dict[str, float]:
    return {
        name.split(".")[1]: value for name, value in given.items() if name.startswith(f"{effect}.")
    }


def _describe_move(searched: Searched, start: float, fitted: float) -> Moved:
    margin = AT_BOUND * (searched.high - searched.low)
    at_bound = bool(fitted <= searched.low + margin or fitted >= searched.high - margin)
    return Moved(searched.name, searched.unit, float(start), float(fitted), at_bound)

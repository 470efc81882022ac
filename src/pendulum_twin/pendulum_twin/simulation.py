"""A twin's answer to a command, for who calls from Python: arrays in, arrays out."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.signals import Signals

UNEVEN_PERIODS = 0.01  # of a period, by which a time may be off the even grid: rounded stamps are


@dataclass(frozen=True)
class Simulation:
    """Hold what a twin's sensors show over time; every array has the shape (n,).

    t: s, as given.
    cart: m, position along the rail, 0 in the middle, positive along the rail.
    pole: rad, angle, 0 upright, pi hanging, counterclockwise positive, not wrapped.
    cart_velocity: m/s.
    pole_velocity: rad/s.
    """

    t: Floats
    cart: Floats
    pole: Floats
    cart_velocity: Floats
    pole_velocity: Floats

    def to_dict(self) -> dict[str, list[float]]:
        """Return the arrays as lists, by name: what JSON can hold."""
        return {field.name: getattr(self, field.name).tolist() for field in fields(self)}

    def to_frame(self) -> Any:
        """Return a pandas DataFrame with a column an array; raise BadInputError without pandas."""
        try:
            import pandas
        except ImportError as error:
            raise BadInputError(
                "expected pandas for a data frame, found it missing: "
                "install pandas, or use to_dict"
            ) from error
        return pandas.DataFrame({field.name: getattr(self, field.name) for field in fields(self)})


def simulate(
    twin: Twin, t: ArrayLike, command: ArrayLike, start: ArrayLike | None = None
) -> Simulation:
    """Return what the twin's sensors show while it is driven by a command.

    twin: constants and effects.
    t: (n,) s, evenly spaced; effects that count the time count it from t[0].
    command: (n,) PWM fraction as the drive receives it, held from each time to the next; the first
        was held before, too. It is not clipped at the rig's limit. Without a cart: the
        acceleration of the pole's axis, m/s^2.
    start: (4,) what the sensors show at t[0]: cart m, pole rad, their velocities m/s and rad/s.
        None: the cart stands in the middle of the rail and the pole hangs at rest.

    The rail has no ends here. A joint that the rig does not have keeps the velocity that it starts
    with.

    Raises BadInputError for times that are not even, for lengths that differ, and for values that
    are not finite numbers.

    A cart under constant force against viscous friction comes to the speed force / friction, here
    0.5 * 8 N / 2 N s/m:

    >>> import numpy as np
    >>> from pendulum_twin import Rig, Twin, simulate
    >>> cart = Rig(cart_mass_kg=1.0, force_per_pwm_n=8.0, cart_viscous_n_s_m=2.0)
    >>> t = np.linspace(0.0, 5.0, 501)
    >>> run = simulate(Twin("cart", cart), t, np.full(len(t), 0.5))
    >>> round(float(run.cart_velocity[-1]), 3)
    2.0
    """
    # the compiler is loaded with the first run, not with the package
    from pendulum_twin.free_runs import run_freely
    from pendulum_twin.parameter_vector import make_theta
    from pendulum_twin.stepper import make_resting_state

    times = read_numbers("t", t)
    signals = _make_signals(times, read_numbers("command", command))
    state = make_resting_state(twin) if start is None else read_numbers("start", start)
    if len(state) != 4:
        raise BadInputError(
            "start: expected cart, pole, cart velocity and pole velocity, "
            f"found {len(state)} numbers"
        )
    first = np.zeros(1, dtype=np.int64)
    theta = make_theta(twin)[None]
    states = run_freely(signals, theta, first, first, np.array([state]), len(times))[0]
    return Simulation(times, states[:, 0], states[:, 1], states[:, 2], states[:, 3])


def read_numbers(name: str, values: ArrayLike) -> Floats:
    """Return finite numbers, (n,); raise BadInputError naming the argument for anything else."""
    try:
        numbers = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise BadInputError(f"{name}: expected numbers, found {values!r:.60}") from error
    if numbers.ndim != 1:
        raise BadInputError(f"{name}: expected numbers in a row, found the shape {numbers.shape}")
    if not np.all(np.isfinite(numbers)):
        raise BadInputError(f"{name}: expected finite numbers, found NaN or infinity")
    return numbers


def _make_signals(t: Floats, command: Floats) -> Signals:
    """Return a recording of this command in which nothing was measured."""
    if len(t) < 2:
        raise BadInputError(f"t: expected at least 2 times, found {len(t)}")
    if len(command) != len(t):
        raise BadInputError(f"command: expected {len(t)} values, one a time, found {len(command)}")
    period_s = float(t[-1] - t[0]) / (len(t) - 1)
    off = np.abs(t - t[0] - period_s * np.arange(len(t)))
    if not period_s > 0.0 or np.max(off) > UNEVEN_PERIODS * period_s:
        steps = np.diff(t)
        raise BadInputError(
            "t: expected evenly spaced, rising times, found steps from "
            f"{steps.min():.4g} to {steps.max():.4g} s: resample the command to an even grid"
        )
    nothing, missing = np.zeros(len(t)), np.zeros(len(t), dtype=bool)
    return Signals(period_s, command, nothing, nothing, missing, missing)

"""Ask whether an error of the angle, the position or the stamps makes up a missing force.

A measured angle that is off by e moves every term of the pole's equation: Jp e'' + fp e' - S (g
cos th - sin th v') e is then lacking, to first order, and -S times the change of cos(th) w' -
sin(th) w^2 in the cart's. A position that is off by e makes m e'' + fc e' lacking. Where the
stamps run slow by a share r, every acceleration is seen too large by 2 r and every velocity by r.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.balance import Balance, Motion, differentiate
from pendulum_sysid.finding.localisation.knots import make_hats
from pendulum_sysid.finding.localisation.questions import (
    Cost,
    Measured,
    Question,
    make_number_question,
    make_time_knots,
)
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
)
from pendulum_twin.signals import Signals

RAIL_WAVES = (
    4,
    16,
)  # half waves over the rail; fewer are a scale, which no motion tells from the mass
POINTS = 49
ANGLE = ("error of the angle", "rad")


def make_sensor_questions(
    signals: Signals, here: Motion, balance: Balance, theta: Floats
) -> list[Question]:
    """Return the questions about sensors and clock in an equation; theta: (SIZE,) of the twin."""
    questions = [_ask_clock(here, balance.equation, theta)]
    if signals.pole is not None:
        questions += _ask_angle(signals, here, balance.equation, theta)
    if balance.equation == FORCE:
        return [*questions, *_ask_position(signals, here, theta)]
    if signals.cart is not None:
        more = Measured("share by which the cart's motion is seen too small", "1", "constant")
        pushed = theta[COUPLING] * np.cos(here.th) * here.a
        questions.append(
            make_number_question("cart_acceleration", "cart_acceleration", "sensor", more, pushed)
        )
    return questions


def _ask_angle(signals: Signals, here: Motion, equation: int, theta: Floats) -> list[Question]:
    sine, cosine = np.sin(here.th), np.cos(here.th)

    def lacking(error: Floats) -> Floats:
        first, second = differentiate(signals, error)
        if equation == FORCE:
            turned = (sine * here.b + cosine * here.w**2) * error + 2 * sine * here.w * first
            return theta[COUPLING] * (turned - cosine * second)
        pull = theta[MOMENT] * theta[GRAVITY] * cosine - theta[COUPLING] * sine * here.a
        return theta[INERTIA] * second + theta[POLE_VISCOUS] * first - pull * error

    everywhere, times = lacking(np.ones_like(here.th)), make_time_knots(here)
    turning = Measured(*ANGLE, "pole_angle")
    x = np.linspace(0.0, 2 * np.pi, POINTS)
    questions = [
        make_number_question(
            "angle_error", "pole_angle", "sensor", Measured(*ANGLE, "constant"), everywhere
        ),
        Question(
            "angle_error*time", "time", "sensor", Cost.PRODUCT, Measured(*ANGLE, "time"),
            lambda: everywhere[:, None] * make_hats(here.t, times), times,
        ),
        Question(
            "angle_error*pole_angle", "pole_angle", "sensor", Cost.PRODUCT, turning,
            _carry_through(lacking, _make_harmonics(here.th)), x, _make_harmonics(x), bends=False,
        ),
    ]  # fmt: skip
    if signals.cart is not None:
        late = Measured("time by which the angle is late", "s", "constant")
        questions.append(
            make_number_question("time_shift", "time_shift", "sensor", late, lacking(here.w), -1.0)
        )
    return questions


def _make_harmonics(angle: Floats) -> Floats:
    """Return sines and cosines of an angle and its multiples, (n, 2 ANGLE_HARMONICS)."""
    return np.stack(
        [
            wave(k * angle)
            for k in range(1, decisions.ANGLE_HARMONICS + 1)
            for wave in (np.sin, np.cos)
        ],
        axis=1,
    )


def _carry_through(lacking: Callable[[Floats], Floats], errors: Floats) -> Callable[[], Floats]:
    return lambda: np.stack([lacking(error) for error in errors.T], axis=1)


def _ask_position(signals: Signals, here: Motion, theta: Floats) -> list[Question]:
    travel = float(np.ptp(here.x))
    if travel <= 0:
        return []

    def lacking(error: Floats) -> Floats:
        first, second = differentiate(signals, error)
        return theta[MASS] * second + theta[CART_VISCOUS] * first

    def make_rail_waves(x: Floats) -> Floats:
        phase = np.pi * (x - here.x.min()) / travel
        return np.stack(
            [np.cos(k * phase) for k in range(RAIL_WAVES[0], RAIL_WAVES[1] + 1)], axis=1
        )

    x = np.linspace(here.x.min(), here.x.max(), POINTS)
    measured = Measured("error of the position", "m", "cart_position")
    make_columns = _carry_through(lacking, make_rail_waves(here.x))
    return [
        Question(
            "position_error*cart_position", "cart_position", "sensor", Cost.PRODUCT, measured,
            make_columns, x, make_rail_waves(x),
            bends=False,
        )
    ]  # fmt: skip


def _ask_clock(here: Motion, equation: int, theta: Floats) -> Question:
    """Ask whether the stamps run slow at some times and fast at others."""
    coupling = theta[COUPLING] * np.cos(here.th)
    if equation == FORCE:
        inertial = (
            theta[MASS] * here.a
            - coupling * here.b
            + theta[COUPLING] * np.sin(here.th) * here.w**2
        )
        momentum, braking = theta[MASS] * here.v - coupling * here.w, theta[CART_VISCOUS] * here.v
    else:
        inertial, braking = (
            theta[INERTIA] * here.b - coupling * here.a,
            theta[POLE_VISCOUS] * here.w,
        )
        momentum = theta[INERTIA] * here.w - coupling * here.v
    times = make_time_knots(here)

    def make_columns() -> Floats:
        share = make_hats(here.t, times)
        change = np.gradient(share, axis=0) / max(float(here.t[1] - here.t[0]), 1e-300)
        return (2 * inertial + braking)[:, None] * share + momentum[:, None] * change

    measured = Measured("share by which stamps run slow", "1", "time")
    return Question("clock*time", "time", "clock", Cost.PRODUCT, measured, make_columns, times)

"""Sine, cosine and the exponential in plain arithmetic, for laws of effects and the equations.

The kernel compiles them (`equations.py`); without branches and calls the compiler computes
neighbouring lanes side by side. The catalogue itself imports no compiler.
"""

from __future__ import annotations

import math

import numpy as np

HALF_PI_INVERSE = 2.0 / math.pi
# pi/2 in two parts; the products of the first with integers up to a million are exact (Cody and
# Waite, 1980).
HALF_PI_HIGH = 1.57079632673412561417e00
HALF_PI_LOW = 6.07710050650619224932e-11
# Minimax polynomials on +-pi/4 (Sun Microsystems, fdlibm 5.3, k_sin.c and k_cos.c).
S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11

LOG2_E = 1.0 / math.log(2.0)
# log 2 in two parts, as pi/2 above (fdlibm, e_exp.c).
LOG_2_HIGH = 6.93147180369123816490e-01
LOG_2_LOW = 1.90821492927058770002e-10


def sin_cos(angle: float) -> tuple[float, float]:
    """Return sine and cosine, each to 3e-16, for angles up to 1e5 rad.

    Without branches or calls, so that lanes are computed side by side, and in short chains, for
    one lane alone.
    """
    turns = np.floor(angle * HALF_PI_INVERSE + 0.5)
    r = (angle - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW
    q = r * r
    q2 = q * q
    q4 = q2 * q2
    s = r + r * q * ((S1 + q * S2) + q2 * (S3 + q * S4) + q4 * (S5 + q * S6))
    c = (1.0 - 0.5 * q) + q2 * ((C1 + q * C2) + q2 * (C3 + q * C4) + q4 * (C5 + q * C6))
    quadrant = turns - 4.0 * np.floor(turns * 0.25)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine = c if odd else s
    cosine = s if odd else c
    sine = -sine if quadrant >= 2.0 else sine
    cosine = -cosine if (quadrant == 1.0) | (quadrant == 2.0) else cosine
    return sine, cosine


def sin_cos_of_array(angle):  # type: ignore[no-untyped-def]
    """Return sine and cosine of a number or an array, for laws of sensors.

    The quadrant is chosen by arithmetic, so that laws of sensors run on plain arrays, too.
    """
    turns = np.floor(angle * HALF_PI_INVERSE + 0.5)
    r = (angle - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW
    q = r * r
    q2 = q * q
    q4 = q2 * q2
    s = r + r * q * ((S1 + q * S2) + q2 * (S3 + q * S4) + q4 * (S5 + q * S6))
    c = (1.0 - 0.5 * q) + q2 * ((C1 + q * C2) + q2 * (C3 + q * C4) + q4 * (C5 + q * C6))
    quadrant = turns - 4.0 * np.floor(turns * 0.25)
    odd = quadrant - 2.0 * np.floor(quadrant * 0.5)
    upper = np.floor(quadrant * 0.5)
    sine = (1.0 - 2.0 * upper) * (odd * c + (1.0 - odd) * s)
    cosine = (1.0 - 2.0 * (odd + upper - 2.0 * odd * upper)) * (odd * s + (1.0 - odd) * c)
    return sine, cosine


def exp(power: float) -> float:
    """Return e to a power, to 4e-16 relative; powers are clipped to -708 to 709.

    For laws of effects: `math.exp` is a call, which would hold all lanes up.
    """
    power = min(max(power, -708.0), 709.0)
    doublings = np.floor(power * LOG2_E + 0.5)
    r = (power - doublings * LOG_2_HIGH) - doublings * LOG_2_LOW
    q = r * r
    q2 = q * q
    low = (1.0 / 2 + r * (1.0 / 6)) + q * (1.0 / 24 + r * (1.0 / 120))
    middle = (1.0 / 720 + r * (1.0 / 5040)) + q * (1.0 / 40320 + r * (1.0 / 362880))
    high = (1.0 / 3628800 + r * (1.0 / 39916800)) + q * (1.0 / 479001600 + r * (1.0 / 6227020800))
    fraction = 1.0 + (r + q * (low + q2 * (middle + q2 * high)))
    # 2 to a whole power, written straight into the exponent of a float64
    return fraction * np.int64((np.int64(doublings) + 1023) << 52).view(np.float64)

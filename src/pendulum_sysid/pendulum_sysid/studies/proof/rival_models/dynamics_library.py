"""The library of a sparse regression: what may accelerate cart and pole.

Terms of force and torque in states and command, each passed on to both joints as the mass matrix
does it: a force f adds f / d to the cart's acceleration and f cos(th) / d to the pole's, and a
torque the other way round, with d = 1 - k cos(th)^2. Only the ratio k of the coupling is taken
from the refitted twin; all coefficients are the regression's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats

KINK = 0.03  # of the root mean square speed: across it a friction changes its sign


@dataclass(frozen=True)
class Library:
    """What the columns are computed with.

    coupling_share: k above, 0 to 1.
    speeds: root mean square v (m/s) and w (rad/s).
    """

    coupling_share: float
    speeds: tuple[float, float]

    def evaluate(self, states: Floats, command: Floats) -> tuple[Floats, Floats]:
        """Return the columns for v' and for w', (k, terms) each.

        states: (k, 4) x (m), th (rad), v (m/s), w (rad/s).
        command: (k,).
        """
        forces = np.stack(list_forces(states, command, self.speeds), axis=1)
        torques = np.stack(list_torques(states, self.speeds), axis=1)
        cosine = np.cos(states[:, 1])[:, None]
        share = 1.0 / (1.0 - self.coupling_share * cosine**2)
        forces *= share
        torques *= share
        return (
            np.concatenate([forces, cosine * torques], axis=1),
            np.concatenate([cosine * forces, torques], axis=1),
        )


def list_forces(states: Floats, command: Floats, speeds: tuple[float, float]) -> list[Floats]:
    """Return terms of the force on the cart, (k,) each."""
    x, th, v, w = states.T
    u, speed = command, np.abs(v)
    way = np.tanh(v / (KINK * speeds[0]))
    return [
        u, u * np.abs(u), u**3, np.abs(u), u * x, u * x**2, u * speed, u * v, np.sign(u),
        np.ones_like(x), x, x**2, x**3,
        v, v * speed, v**3, v * x, v * x**2, v * np.abs(w), v * w**2,
        way, way * x, way * x**2, speed, speed * way * x,
        w**2 * np.sin(th), w**2 * np.cos(th), w, w * np.sin(th), np.abs(w) * way,
    ]  # fmt: skip


def list_torques(states: Floats, speeds: tuple[float, float]) -> list[Floats]:
    """Return terms of the torque on the pole, (k,) each."""
    _, th, v, w = states.T
    rate = np.abs(w)
    way = np.tanh(w / (KINK * speeds[1]))
    return [
        np.sin(th), np.cos(th), np.sin(2.0 * th), np.cos(2.0 * th), np.sin(3.0 * th),
        np.cos(3.0 * th), np.ones_like(th),
        w, w * rate, w**3, rate, w * np.cos(th), w * np.sin(th), way, way * np.cos(th),
        way * np.sin(th), way * rate * np.cos(th),
        v, v * np.abs(v), v * np.cos(th), np.abs(v) * w, np.abs(v) * way,
    ]  # fmt: skip

"""A small neural state-space model, trained on free runs over many samples.

In discrete time a network gives how much both velocities change in a sample period; positions
follow from the velocities. A multi-step loss as of Forgione and Piga, European Journal of Control
59 (2021) 69. Beside the network stands a part that is linear in products which any pendulum on a
cart has. The weights, and their decay, are those that run the choosing windows best.
"""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rival_models.model import Model, check_both_joints
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import Signals

PACKAGE = "torch"
NETWORK = "pendulum_sysid.studies.proof.rival_models.network"  # imports torch, which takes seconds
INPUTS, TERMS = 6, 12  # of the network, and of the linear part


def check_installed() -> None:
    """Raise BadInputError when torch is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise BadInputError(
            "expected the package torch for the rival of a neural state-space model, found it "
            "missing: install it, or leave out --rivals"
        )


@dataclass(frozen=True)
class Scales:
    """What normalises a network.

    inputs: (4,) by which x (m), v (m/s), w (rad/s) and the command are divided.
    changes: (2,) by which the output is multiplied, m/s and rad/s a sample.
    """

    inputs: Floats
    changes: Floats


@dataclass(frozen=True)
class NeuralStateSpace:
    """A trained network as numbers.

    layers: weights (outputs, inputs) and biases (outputs,), hyperbolic tangents between them.
    direct: (2, TERMS) the linear part.
    """

    layers: tuple[tuple[Floats, Floats], ...]
    direct: Floats
    scales: Scales

    def run(self, signals: Signals, windows: Windows) -> Floats:
        """Return free runs; see `Model`."""
        period_s = signals.period_s
        runs = np.empty((len(windows), windows.samples, 4))
        runs[:, 0] = states = windows.start_states
        for n in range(windows.samples - 1):
            change = self.predict_change(states, signals.command[windows.begin + n])
            places = states[:, :2] + period_s * (states[:, 2:] + 0.5 * change)
            states = np.concatenate([places, states[:, 2:] + change], axis=1)
            runs[:, n + 1] = states
        return runs

    def predict_change(self, states: Floats, command: Floats) -> Floats:
        """Return how much v (m/s) and w (rad/s) change until the next sample, (k, 2)."""
        terms = list_terms(states, command, self.scales)
        hidden = terms[:, :INPUTS]
        for weights, biases in self.layers[:-1]:
            hidden = np.tanh(hidden @ weights.T + biases)
        weights, biases = self.layers[-1]
        out = hidden @ weights.T + biases + terms @ self.direct.T
        return out * self.scales.changes


def list_terms(states: Floats, command: Floats, scales: Scales) -> Floats:
    """Return the terms of the linear part, (k, TERMS); the first INPUTS enter the network.

    These are x, sin th, cos th, v, w and the command, normalised.
    """
    x_scale, v_scale, w_scale, u_scale = scales.inputs
    x, th, v, w = states.T
    x, v, w, u = x / x_scale, v / v_scale, w / w_scale, command / u_scale
    sine, cosine = np.sin(th), np.cos(th)
    terms = (
        *(x, sine, cosine, v, w, u),
        *(u * cosine, v * cosine, w * cosine, sine * cosine, sine * w**2, sine * w**2 * cosine),
    )
    return np.stack(terms, axis=1)


def fit_model(ground: Ground) -> Model:
    """Return the trained network; the imports of torch wait until here."""
    check_both_joints(ground)
    model: Model = importlib.import_module(NETWORK).train_network(ground)
    return model

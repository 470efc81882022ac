"""Train the network of `neural_state_space`; the only module of the diagnosis that needs torch."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rival_models.neural_state_space import (
    INPUTS,
    NeuralStateSpace,
    Scales,
    list_terms,
)
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.rivals.sparse_regression import list_samples
from pendulum_twin.arrays import Floats, Ints

HIDDEN = (24, 24)
DECAYS = (0.03, 0.3)  # of the network's weights, by Adam's rate; the better is trained on
SEED = 0
BATCH = 96
PRETRAINING = 500  # gradient steps on the smoothed changes of a single sample
# (samples a run, gradient steps): short runs first, for long runs of a wrong network diverge
SHORT_STAGES = ((5, 300), (20, 300))  # by which the decay is chosen
LONG_STAGES = ((50, 400), (100, 200))
RATE, LAST_RATE = 5e-3, 1e-4  # of Adam: falls from stage to stage, and within each
MOST_NORM = 1.0  # of a gradient
CHECK_EVERY = 50  # steps: is there time left?
MOST_CPU_S = 50.0  # of training


@dataclass(frozen=True)
class Samples:
    """Hold training data, sample by sample along the recording.

    states: (n, 4) smoothed.
    command: (n,).
    measured: (n, 2) m and rad.
    valid: (n, 2) 1 for valid samples, else 0.
    noise: (2,) m and rad.
    period_s: s from sample to sample.
    """

    states: Tensor
    command: Tensor
    measured: Tensor
    valid: Tensor
    noise: Tensor
    period_s: float


class Trainer:
    """Hold the weights while they are trained."""

    def __init__(self, ground: Ground, decay: float) -> None:
        random = np.random.default_rng(SEED)
        sizes = (INPUTS, *HIDDEN, 2)
        self.random, self.decay = random, decay
        self.scales, direct = make_scales(ground.case, ground.split.train)
        self.tensors = [torch.from_numpy(values) for values in vars(self.scales).values()]
        self.layers: list[tuple[Tensor, Tensor]] = []
        for a, b in pairwise(sizes):
            size = (1.0 if len(self.layers) < len(HIDDEN) else 0.1) / np.sqrt(a)
            self.layers.append(
                (_make_weights(random.normal(0.0, size, (b, a))), _make_weights(np.zeros(b)))
            )
        self.direct = _make_weights(direct)

    @property
    def weights(self) -> list[Tensor]:
        """Return all weights."""
        return [self.direct, *(weights for layer in self.layers for weights in layer)]

    def make_optimizer(self, rate: float) -> torch.optim.Optimizer:
        """Return an optimiser in which only the weights between layers decay."""
        decaying = [weights for weights, _ in self.layers]
        others = [self.direct, *(biases for _, biases in self.layers)]
        groups = [
            {"params": decaying, "weight_decay": self.decay},
            {"params": others, "weight_decay": 0.0},
        ]
        return torch.optim.AdamW(groups, rate)

    def predict_change(self, states: Tensor, command: Tensor) -> Tensor:
        """Return the change of v and w in a sample period, (k, 2); see `NeuralStateSpace`."""
        inputs, changes = self.tensors
        x, th, v, w = states.unbind(dim=1)
        x, v, w, u = x / inputs[0], v / inputs[1], w / inputs[2], command / inputs[3]
        sine, cosine = torch.sin(th), torch.cos(th)
        whirl, both = sine * w**2, torch.stack([u, v, w, sine], dim=1) * cosine[:, None]
        own = torch.stack([x, sine, cosine, v, w, u, whirl, whirl * cosine], dim=1)
        terms = torch.cat([own[:, :INPUTS], both, own[:, INPUTS:]], dim=1)
        hidden = own[:, :INPUTS]
        for weights, biases in self.layers[:-1]:
            hidden = torch.tanh(torch.addmm(biases, hidden, weights.T))
        weights, biases = self.layers[-1]
        out = torch.addmm(torch.addmm(biases, hidden, weights.T), terms, self.direct.T)
        return out * changes

    def export(self) -> NeuralStateSpace:
        """Return the network as it is now."""
        layers = tuple(
            (_read_values(weights), _read_values(biases)) for weights, biases in self.layers
        )
        return NeuralStateSpace(layers, _read_values(self.direct), self.scales)


def train_network(ground: Ground) -> NeuralStateSpace:
    """Return the trained network.

    Short runs of the training windows train a network for each decay. The network with the least
    loss on the choosing windows goes on, with the choosing windows for training, too.
    """
    deadline_s = time.process_time() + MOST_CPU_S
    split, samples = ground.split, make_samples(ground.case)
    rates = np.geomspace(RATE, LAST_RATE, len(SHORT_STAGES) + len(LONG_STAGES) + 1)
    with _limit_threads():
        trainers = [Trainer(ground, decay) for decay in DECAYS]
        for trainer in trainers:
            train_on_changes(trainer, samples, list_samples(split.train)[:, :-1].reshape(-1))
            for k, stage in enumerate(SHORT_STAGES):
                train_on_runs(trainer, samples, split.train, (*stage, deadline_s), rates[k:])
        losses = [measure_loss(trainer, samples, split.choose) for trainer in trainers]
        best = trainers[int(np.argmin(losses))]
        for k, stage in enumerate(LONG_STAGES, len(SHORT_STAGES)):
            train_on_runs(best, samples, split.learn, (*stage, deadline_s), rates[k:])
    return best.export()


def make_scales(case: Case, train: Windows) -> tuple[Scales, Floats]:
    """Return the scales, and the linear part (2, TERMS) that fits the smoothed changes best."""
    at = list_samples(train)[:, :-1].reshape(-1)
    states, command = case.state.states, case.signals.command
    sizes = np.std(states[at][:, [0, 2, 3]], axis=0), np.std(command[at])
    changes = states[at + 1, 2:] - states[at, 2:]
    scales = Scales(
        np.maximum(np.append(*sizes), 1e-9), np.maximum(np.std(changes, axis=0), 1e-12)
    )
    terms = list_terms(states[at], command[at], scales)
    return scales, np.linalg.lstsq(terms, changes / scales.changes, rcond=None)[0].T


def make_samples(case: Case) -> Samples:
    """Return the recording as tensors."""
    signals = case.signals
    measured = np.stack([np.asarray(signals.cart), np.asarray(signals.pole)], axis=1)
    valid = np.stack([signals.cart_valid, signals.pole_valid], axis=1).astype(np.float64)
    return Samples(
        states=torch.from_numpy(case.state.states),
        command=torch.from_numpy(signals.command.copy()),
        measured=torch.from_numpy(measured),
        valid=torch.from_numpy(valid),
        noise=torch.from_numpy(case.noise),
        period_s=signals.period_s,
    )


def train_on_changes(trainer: Trainer, samples: Samples, at: Ints) -> None:
    """Train on the smoothed changes from samples `at` to the next."""
    optimizer = trainer.make_optimizer(RATE)
    changes = trainer.tensors[1]
    for _ in range(PRETRAINING):
        batch = torch.from_numpy(trainer.random.choice(at, 2 * BATCH))
        change = samples.states[batch + 1, 2:] - samples.states[batch, 2:]
        predicted = trainer.predict_change(samples.states[batch], samples.command[batch])
        _take_step(optimizer, trainer, torch.mean(((predicted - change) / changes) ** 2))


def train_on_runs(
    trainer: Trainer,
    samples: Samples,
    windows: Windows,
    work: tuple[int, int, float],
    rates: Floats,
) -> None:
    """Train on free runs inside windows.

    work: samples a run, gradient steps, and the CPU time of the process when training ends, s.
    rates: of Adam, at the first and the last step.
    """
    most, steps, deadline_s = work
    length = min(most, windows.samples - 1)
    begins = list_samples(windows)[:, : windows.samples - length].reshape(-1)
    optimizer = trainer.make_optimizer(rates[0])
    falling = (rates[1] / rates[0]) ** (1.0 / steps)
    schedule = torch.optim.lr_scheduler.ExponentialLR(optimizer, falling)
    for step in range(1, steps + 1):
        batch = torch.from_numpy(trainer.random.choice(begins, BATCH))
        _take_step(optimizer, trainer, compute_loss(trainer, samples, batch, length))
        schedule.step()
        if step % CHECK_EVERY == 0 and time.process_time() > deadline_s:
            return


def measure_loss(trainer: Trainer, samples: Samples, windows: Windows) -> float:
    """Return the loss of runs over whole windows; infinite for runs that diverge."""
    with torch.no_grad():
        begins = torch.from_numpy(windows.begin)
        loss = float(compute_loss(trainer, samples, begins, windows.samples - 1))
    return loss if np.isfinite(loss) else np.inf


def compute_loss(trainer: Trainer, samples: Samples, begins: Tensor, length: int) -> Tensor:
    """Return the mean logarithm of the squared errors of free runs, in units of the noise.

    Each run and each channel has a variance of its own, not below the noise: runs that magnify
    their start do not outshout all others.
    """
    states, places = samples.states[begins], []
    along = begins[:, None] + torch.arange(length + 1)
    commands = samples.command[along].T
    for command in commands[:-1]:
        change = trainer.predict_change(states, command)
        places.append(states[:, :2] + samples.period_s * (states[:, 2:] + 0.5 * change))
        states = torch.cat([places[-1], states[:, 2:] + change], dim=1)
    errors = torch.stack(places, dim=1) - samples.measured[along[:, 1:]]
    errors = errors * samples.valid[along[:, 1:]] / samples.noise
    return torch.log(1.0 + torch.mean(errors**2, dim=1)).mean()


def _take_step(optimizer: torch.optim.Optimizer, trainer: Trainer, loss: Tensor) -> None:
    optimizer.zero_grad()
    loss.backward()
    norm = torch.nn.utils.clip_grad_norm_(trainer.weights, MOST_NORM)
    if torch.isfinite(norm):
        optimizer.step()


def _make_weights(values: Floats) -> Tensor:
    return torch.tensor(values, dtype=torch.float64, requires_grad=True)


def _read_values(values: Tensor) -> Floats:
    return values.detach().numpy().copy()


@contextmanager
def _limit_threads() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)

"""Rigs that change while they are watched: the truth, the twin of a diagnosis, and a change."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pendulum_bridge.emulator.load import add_load
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.watch.alarm import Alarm
from pendulum_bridge.watch.watch import Phase, Watch
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.plans.excitation import compute_command, make_standard_plan
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

RATE_HZ = 100.0
NOMINAL = load_twin(Path(__file__).parents[2] / "config" / "inteco.yaml").rig
WRONG = (
    "cart_viscous_n_s_m",
    "force_per_pwm_n",
    "com_distance_m",
    "pole_inertia_kg_m2",
    "pole_viscous_n_m_s",
)
MINUTE = round(60 * RATE_HZ)
STRENGTHS = (1.0, 0.6, 0.35)  # of the plan, minute by minute
HANGING = (0.0, np.pi, 0.0, 0.0)
Make = Callable[[Concealed, tuple[float, ...]], "object"]


def make_rig(seed: int) -> Concealed:
    """Return a rig that is not quite the nominal one, with dry friction on its cart."""
    random = np.random.default_rng(seed)
    rig = replace(NOMINAL, cart_viscous_n_s_m=1.5, force_per_pwm_n=11.0)
    rig = replace(
        rig, **{key: getattr(rig, key) * (1 + random.uniform(-0.15, 0.15)) for key in WRONG}
    )
    return Concealed({"cart_coulomb_friction": {"level_n": float(random.uniform(0.3, 0.7))}}, rig)


def make_twin(truth: Concealed, seed: int, off: float = 0.02) -> Twin:
    """Return the rig's twin with every constant off by up to a share, as a diagnosis leaves it."""
    random = np.random.default_rng(seed + 1000)
    rig = replace(
        truth.rig,
        **{key: getattr(truth.rig, key) * (1 + random.uniform(-off, off)) for key in WRONG},
    )
    effects = {
        name: {key: value * (1 + random.uniform(-off, off)) for key, value in values.items()}
        for name, values in truth.effects.items()
    }
    return Twin("improved", rig, effects)


@dataclass(frozen=True)
class Change:
    """Hold what changes about a rig.

    place: at which an alarm has to put it.
    effects, constants: of the rig after the change.
    """

    name: str
    place: str
    effects: Callable[[Concealed], dict[str, dict[str, float]]] = lambda truth: {}
    constants: Callable[[Rig], dict[str, float]] = lambda rig: {}

    def apply(self, truth: Concealed) -> Concealed:
        """Return the rig after the change."""
        return Concealed(
            {**truth.effects, **self.effects(truth)},
            replace(truth.rig, **self.constants(truth.rig)),
        )


def _double_friction(truth: Concealed) -> dict[str, dict[str, float]]:
    return {
        "cart_coulomb_friction": {"level_n": 2 * truth.effects["cart_coulomb_friction"]["level_n"]}
    }


def _load_cart(rig: Rig) -> dict[str, float]:
    loaded = add_load(rig, 0.1)
    return {key: getattr(loaded, key) for key in ("cart_mass_kg", "com_distance_m")}


CHANGES = (
    Change("encoder slips by 0.05 rad", "sensor", lambda t: {"angle_offset": {"angle_rad": 0.05}}),
    Change("dry friction of the cart doubles", "cart", _double_friction),
    Change(
        "drive loses 15 % of its force",
        "drive",
        constants=lambda rig: {"force_per_pwm_n": 0.85 * rig.force_per_pwm_n},
    ),
    Change("commands act 15 ms later", "command", lambda t: {"input_delay": {"delay_s": 0.015}}),
    Change(
        "pole's friction triples",
        "pole",
        constants=lambda rig: {"pole_viscous_n_m_s": 3 * rig.pole_viscous_n_m_s},
    ),
    Change("rail tilts by 1 degree", "cart", lambda t: {"rail_tilt": {"angle_rad": 0.01745}}),
    Change("a load of 0.1 kg is put on the cart", "cart", constants=_load_cart),
)


@dataclass(frozen=True)
class Wire:
    """Say how samples reach the watch.

    jitter_s: s; standard deviation of stamps.
    lost: share of samples.
    """

    jitter_s: float = 0.0
    lost: float = 0.0


CLEAN = Wire()


class KernelRig:
    """A rig moved by the twin's own kernel, fast; its encoders count as given."""

    def __init__(self, truth: Concealed, start: tuple[float, ...], counts: int = 4096) -> None:
        self._stepper = Stepper(Twin("rig", truth.rig, truth.effects), 1 / RATE_HZ, HANGING)
        offset = truth.effects.get("angle_offset", {}).get("angle_rad", 0.0)
        self._stepper.reset((start[0], start[1] + offset, start[2], start[3]))
        self._offset, self._steps = offset, np.array([57e-6, 2 * np.pi / counts])

    @property
    def truth(self) -> np.ndarray:
        return self._stepper.state - [0.0, self._offset, 0.0, 0.0]

    @property
    def sample(self) -> np.ndarray:
        state = self._stepper.state
        return np.concatenate([np.round(state[:2] / self._steps) * self._steps, state[2:]])

    def step(self, command: float) -> None:
        self._stepper.step(command)


def drive(
    make: Make, truth: Concealed, seed: int, change: Change | None = None, at_s: float = 0.0
) -> Iterator[tuple]:
    """Yield (number, positions, command) for ever: standard plans of a minute, end to end."""
    random, rig, number = np.random.default_rng(seed + 2000), make(truth, HANGING), 0
    while True:
        plan, strength = (
            make_standard_plan(seconds=60.0, rate_hz=RATE_HZ, seed=int(random.integers(1 << 30))),
            random.choice(STRENGTHS),
        )
        plan = replace(plan, commands=strength * plan.commands)
        for k in range(MINUTE):
            if change is not None and number == round(at_s * RATE_HZ):
                rig = make(change.apply(truth), tuple(map(float, rig.truth)))
            sample = rig.sample
            command = compute_command(plan, k, float(sample[0]), float(sample[2]), 1)
            yield number, sample[:2].copy(), command
            rig.step(command)
            number += 1


@dataclass(frozen=True)
class Watched:
    """Hold how a watch did.

    alarm: its first; None without an alarm.
    raised_s: s; when that came.
    learned_s: s; when it had learned.
    seconds: s; how long it saw.
    cpu_s: s; its CPU time.
    """

    watch: Watch
    alarm: Alarm | None
    raised_s: float | None
    learned_s: float | None
    seconds: float
    cpu_s: float


def watch_run(
    watch: Watch,
    run: Iterator[tuple],
    seconds: float,
    wire: Wire = CLEAN,
    seed: int = 0,
    then_s: float = 0.0,
) -> Watched:
    """Feed a watch from a run until then_s after its first alarm, for some seconds at most."""
    random, learned_s, cpu_s, first, raised_s = np.random.default_rng(seed), None, 0.0, None, None
    for number, positions, command in run:
        now_s = number / RATE_HZ
        if now_s >= (seconds if raised_s is None else min(seconds, raised_s + then_s)):
            return Watched(watch, first, raised_s, learned_s, now_s, cpu_s)
        at_ns = 10**9 + round(now_s * 1e9)
        stamp_ns, lost = (
            at_ns + round(wire.jitter_s * random.normal() * 1e9),
            random.random() < wire.lost,
        )
        begin = time.process_time()
        alarm = None if lost else watch.sample(stamp_ns, at_ns, positions)
        watch.command(command, at_ns + 10**6)
        cpu_s += time.process_time() - begin
        if learned_s is None and watch.phase is Phase.WATCHING:
            learned_s = now_s
        if alarm is not None and first is None:
            first, raised_s = alarm, now_s
    return Watched(watch, first, raised_s, learned_s, seconds, cpu_s)

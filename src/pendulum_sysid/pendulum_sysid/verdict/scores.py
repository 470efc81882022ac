"""How well the twins of a verdict run on the recording, and what is left."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BeforeAfter:
    """Hold an error of the twin as given and of the improved twin; infinite if a run diverges."""

    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class FitScores:
    """Hold how well both twins run on the recording.

    Attributes:
        train: score on the windows of the fit; 1 is the noise of the sensors.
        held_out: score on windows that neither fit nor choice of effects has seen.
        held_out_cart_mm: root mean square error of the cart, mm; None for a cart not recorded.
        held_out_pole_rad: root mean square error of the pole, rad; None for a pole not recorded.
        held_out_cart_fit, held_out_pole_fit: fit (NRMSE) of the held-out runs in per cent: 100 is
            perfect, 0 no better than the mean of each window; None for a joint not recorded.
        floors: the error over that of a perfect model, 1 at least, by the same measure before
            and after: of the median held-out window; of all held-out windows together where
            nothing explains the error, or the recording does not look like its rig, and that is
            more; the scale of the report.
        noise_floor: score that a perfect model reaches on the held-out windows; NaN (null in
            verdict.json) where that cannot be measured, because the twin leaves all bounds.
        unit: "score".
    """

    train: BeforeAfter
    held_out: BeforeAfter
    held_out_cart_mm: BeforeAfter | None = None
    held_out_pole_rad: BeforeAfter | None = None
    held_out_cart_fit: BeforeAfter | None = None
    held_out_pole_fit: BeforeAfter | None = None
    floors: BeforeAfter | None = None
    noise_floor: float
    unit: str = "score"


@dataclass(frozen=True)
class Repeats:
    """Hold how much of the remaining squared error comes again with the same motion.

    A model can explain what comes again. What does not may be random.

    Attributes:
        share: of the squared error, 0 to 1; the mean over windows of 1 s. At least so much comes
            again: no two motions are quite the same.
        low, high: 95 % interval of the share.
        windows: number of windows whose motion comes again in the recordings.
        random_floors: error that may be random, at most, over the error of a perfect model on a
            rig without randomness; 1 at least.
    """

    share: float
    low: float
    high: float
    windows: int
    random_floors: float


@dataclass(frozen=True)
class WanderingForce:
    """Hold the force that would make up for what the improved twin still lacks.

    Attributes:
        force_n, torque_n_m: standard deviations, on the cart and on the pole; None for a joint
            that was not recorded.
        correlation_s: time over which they stay alike.
        random_share: of the missing power, 0 to 1, that depends on nothing that was asked.
    """

    force_n: float | None
    torque_n_m: float | None
    correlation_s: float
    random_share: float


@dataclass(frozen=True)
class Remainder:
    """Hold what the improved twin still does not explain.

    Attributes:
        place: where in the chain the remainder comes in.
        above_noise_floor: error of the improved twin over the error of a perfect model, above 1.
        finding: the variable that the remainder depends on, in words.
        repeats: how much of the remainder comes again; None where the recordings go through too
            few motions twice.
        wandering: the force that would make up for the remainder.
        whole_windows: error over windows of full length with fitted start states, over the noise
            of the sensors, 1 at least; None in older files.
    """

    place: str
    above_noise_floor: float
    finding: str
    repeats: Repeats | None = None
    wandering: WanderingForce | None = None
    whole_windows: float | None = None

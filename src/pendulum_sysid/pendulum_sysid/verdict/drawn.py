"""What a report shows beside a verdict, and `verdict.json` does not hold."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid.records import Overlay
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class Origin:
    """Hold how a verdict came about.

    Attributes:
        date: day and time, ISO 8601 with the zone.
        version: of the package.
        recordings: paths, as they were given.
        twin: path of the twin file, as it was given.
        twin_digest: "sha256:..." of that file.
        folder: of the report and of the files beside it, as it was given.
        topics: further options that reading these recordings needs, as on the command line.
        constants: names of the constants that no fit changes (`--hold`).
        effects: folders with effects of the user's own (`--effects`).
    """

    date: str
    version: str
    recordings: tuple[str, ...]
    twin: str
    twin_digest: str
    folder: str
    topics: tuple[str, ...] = ()
    constants: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Motion:
    """Hold the whole recording as it was cleaned.

    Attributes:
        times_s: (n,) s, counted through all recordings, gaps included.
        command: (n,) as recorded: PWM fraction or volts.
        cart, cart_velocity: (n,) m and m/s; None for a recording without a cart. NaN where a
            sample was missing or left out.
        pole, pole_rate: (n,) rad and rad/s; None for a recording without a pole.
        left_out_s: s, times of samples that the cleaning left out or filled.
        breaks_s: s, times at which a stretch ends and the next begins.
    """

    times_s: Floats
    command: Floats
    cart: Floats | None
    cart_velocity: Floats | None
    pole: Floats | None
    pole_rate: Floats | None
    left_out_s: Floats
    breaks_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class ResidualTest:
    """Hold what the errors of held-out free runs still show, of one channel.

    Attributes:
        channel: "cart" or "pole".
        unit: "m" or "rad".
        lags_s: (lags,) s, from 0.
        whiteness: (lags,) autocorrelation of the errors of the improved twin, -1 to 1.
        white_limit: half width of the 95 % band of white errors.
        command_lags_s: (more lags,) s; positive: the error follows the command.
        command: (more lags,) correlation of the errors with the command; empty without a command.
        command_limit: half width of the 95 % band of errors that the command does not explain.
        frequencies_hz: (lines,) Hz.
        before, after: (lines,) amplitude spectral density of both twins' errors, per sqrt(Hz).
        noise: the same of the sensor's noise alone.
    """

    channel: str
    unit: str
    lags_s: Floats
    whiteness: Floats
    white_limit: float
    command_lags_s: Floats
    command: Floats
    command_limit: float
    frequencies_hz: Floats
    before: Floats
    after: Floats
    noise: float


@dataclass(frozen=True)
class Drawings:
    """Hold what a report draws besides the held-out runs.

    Attributes:
        motion: the whole recording.
        learned: runs over the windows that fit and choice used, a channel each.
        residuals: tests of the held-out errors, a channel each.
    """

    motion: Motion
    learned: tuple[Overlay, ...] = ()
    residuals: tuple[ResidualTest, ...] = ()

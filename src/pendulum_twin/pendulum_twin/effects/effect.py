"""What an effect is: a formula at one named place of the chain, with units, neutral values and a source."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

HALF_STEP_S = 5e-4  # of the kernel's longest step: finer times are lost in it
ROUNDING = 3.0**0.5  # deviations of rounding in half a step


class Place(Enum):
    """The places of the chain command -> drive -> cart and pole -> sensor, and the clock beside it."""

    COMMAND = "command"
    DRIVE = "drive"
    CART = "cart"
    POLE = "pole"
    SENSOR = "sensor"
    CLOCK = "clock"


class Form(Enum):
    """How an effect's law is called; see `Effect.law`."""

    FILTER = "filter"  # of the command: law(u, memory, h, t, *constants, *parameters) -> u, once a substep
    FORCE = "force"  # on the cart in N, or torque on the pole in N m: law(x, v, th, w, *constants, *parameters)
    DRY = "dry"  # level of dry friction in N or N m, at least 0: law(speed, position, *parameters)
    DRY_RATIO = "dry_ratio"  # factor on the dry friction of its joint: law(direction, *parameters)
    HOLD = "hold"  # True while the whole state is frozen: law(force, v, w, *parameters)
    MEASURE = "measure"  # true state to measured state: law(x, v, th, w, t, *parameters) -> (x, v, th, w)
    REPORT = "report"  # what is reported of a velocity, sample by sample: law(v, before, period_s, *parameters) -> v
    CLOCK = "clock"  # how much time passes while the stamps go on by one second: law(*parameters)


class Scale(Enum):
    """What a parameter's typical sizes are fractions of; the fit takes the scale from rig and recording."""

    ONE = "one"
    COMMAND = "command"  # largest command
    FORCE = "force"  # largest force of the drive, N
    TORQUE = "torque"  # root mean square of the pole's torque, N m
    CART_SPEED = "cart_speed"  # root mean square, m/s
    CART_TRAVEL = "cart_travel"  # half of the range travelled, m
    POLE_RATE = "pole_rate"  # root mean square, rad/s
    SECONDS = "seconds"  # length of the recording, s


@dataclass(frozen=True)
class Parameter:
    """Describe one parameter of an effect.

    neutral: the value at which the effect vanishes exactly (together with its other parameters'
    neutral values).
    low, high: range that a twin file may give and a fit may reach.
    most: largest value that a fit may reach, in units of scale: beyond it the parameter shows
    nothing of the effect.
    fewest: smallest value that a fit may reach, in units of scale: below it the recording holds
    hardly a sample of it.
    least: distance from neutral below which a size means nothing, because the simulation itself is
    no finer.
    rounding: the same in deviations of the pole's sensor: an encoder's zero lies anywhere within a
    step of its counts.
    located: True for a time that is read off the recording, to a sample, and not fitted: a run
    jumps with it.
    shape: True for a parameter that says where or how (a period, a place, a limit) rather than how
    much.
    probes: typical sizes, from which a search starts; in units of scale (or of scale/other scale:
    see `per`).
    per: a second scale by which the first is divided, e.g. FORCE per CART_SPEED for a viscous
        coefficient; squared where per_power is 2.
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    probes: tuple[float, ...]
    scale: Scale = Scale.ONE
    per: Scale = Scale.ONE
    per_power: int = 1
    shape: bool = False
    most: float = math.inf
    fewest: float = -math.inf
    least: float = 0.0
    rounding: float = 0.0
    located: bool = False


@dataclass(frozen=True)
class Effect:
    """Describe one piece of physics beyond the base model.

    name: the catalogue's name, also in twin files and verdicts.
    law: plain Python on numbers, compiled into the kernel; its arguments depend on the form (see
    `Form`).
    sentence: for a person, with the parameters' names in braces.
    source: where the formula is from.
    constants: names of base words (see `pendulum_twin.parameter_vector`) that the law takes before
    its parameters.
    inverse: of a MEASURE law: measured state to true state.
    memory: of a FILTER law: how many numbers it keeps from substep to substep, given the substep h
        in s. They start as zeros; memory[0] stays 0 until the law has been called once.
    simpler: names of effects that this one contains as a special case; a search falls back to
    them.
    becomes: names of effects that this one looks like at an end of its range: a patch as wide as
        the rail is friction everywhere. Nothing is gained by calling these two apart.
    shows_as: name of the effect from which no motion of a rig can part this one, whatever its
        constants; a search names that one, and this one beside it.
    of_recording: True for what one recording shows and the rig does not keep: a slip at an instant,
        a start that belongs to another run. Live twins, training and the watch leave it out.
    searched: False for effects that only describe an existing simulation and are no hypothesis
    about a rig. An effect without parameters is on or off: its law gets one number, 1 or 0.
    """

    name: str
    place: Place
    form: Form
    law: Callable[..., Any]
    sentence: str
    source: str
    parameters: tuple[Parameter, ...] = ()
    constants: tuple[str, ...] = ()
    inverse: Callable[..., Any] | None = None
    memory: Callable[[float], int] | None = None
    simpler: tuple[str, ...] = ()
    becomes: tuple[str, ...] = ()
    shows_as: str | None = None
    of_recording: bool = False
    searched: bool = True

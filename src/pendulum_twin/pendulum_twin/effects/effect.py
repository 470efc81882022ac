"""Describe an effect: a formula at a named place of the chain, its parameters, its source."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from pendulum_twin.rig import Rig

HALF_STEP_S = 5e-4  # half of the kernel's longest step: finer times are lost in it


class Place(Enum):
    """The places of the chain: command, drive, cart and pole, sensor; and the clock beside it."""

    COMMAND = "command"
    DRIVE = "drive"
    CART = "cart"
    POLE = "pole"
    SENSOR = "sensor"
    CLOCK = "clock"


class Form(Enum):
    """The ways in which the kernel calls an effect's law.

    Arguments: u command; h substep, s; t time since the recording began, s; x, v, th, w state;
    parameters and constants in the effect's order.
    """

    # command to command, once a substep: law(u, memory, h, t, *constants, *parameters) -> u
    FILTER = "filter"
    # force on the cart in N or torque on the pole in N m:
    # law(x, v, th, w, *constants, *parameters) -> force
    FORCE = "force"
    # level of dry friction, N or N m, at least 0: law(speed, position, *parameters) -> level
    DRY = "dry"
    # factor on the dry friction of its joint: law(direction, *parameters) -> factor
    DRY_RATIO = "dry_ratio"
    # factor on the force of the drive, held over a step: law(x, *parameters) -> factor
    GAIN = "gain"
    # force of the drive, N, and viscous friction in N s/m added to the cart's, held over a step:
    # law(force, v, *constants, *parameters) -> force, viscous
    DRIVE = "drive"
    # force on the cart in N, held over a step: law(t, *parameters) -> force
    TIMED_FORCE = "timed_force"
    # level of dry friction in N, at least 0, and viscous friction in N s/m of the cart, held over
    # a step: law(t, *parameters) -> level, viscous
    TIMED_FRICTION = "timed_friction"
    # mass in kg that is added to all that moves along the rail, held over a step of h s:
    # law(t, h, *constants, *parameters) -> mass
    TIMED_MASS = "timed_mass"
    # force on the cart in N that follows its path, held over a step; 0 where the path begins:
    # law(force, move, *parameters) -> force after a move of so many m
    PATH_FORCE = "path_force"
    # level of dry friction of the cart in N, at least 0, held over a step:
    # law(th, w, *constants, *parameters) -> level
    STATE_FRICTION = "state_friction"
    # whether the whole state stands still: law(force, v, w, *parameters) -> bool
    HOLD = "hold"
    # true state to measured state: law(x, v, th, w, t, *constants, *parameters) -> (x, v, th, w)
    MEASURE = "measure"
    # how much later than the position the angle is read: law(*parameters) -> s
    LATE = "late"
    # time constant with which the sensor follows the angle: law(*parameters) -> s
    LAGGING = "lagging"
    # reported velocity, sample by sample: law(v, before, period_s, *parameters) -> v
    REPORT = "report"
    # time that passes while the stamps go on by one second: law(*parameters) -> s
    CLOCK = "clock"


class Scale(Enum):
    """The scales of typical sizes, which the fit takes from rig and recording."""

    ONE = "one"
    COMMAND = "command"  # largest command
    FORCE = "force"  # largest force of the drive, N
    TORQUE = "torque"  # root mean square of the pole's torque, N m
    CART_SPEED = "cart_speed"  # root mean square, m/s
    CART_TRAVEL = "cart_travel"  # half of the range travelled, m
    POLE_RATE = "pole_rate"  # root mean square, rad/s
    SECONDS = "seconds"  # length of the recording, s
    CLOCK_END = "clock_end"  # when the recording ends by its clock, s; of several the latest


@dataclass(frozen=True)
class Parameter:
    """Describe one parameter of an effect.

    name: key in twin files; ends in its unit.
    unit: for reports; "1" for a ratio.
    neutral: value at which the effect vanishes exactly, all its parameters being neutral.
    low, high: range that a twin file may give and a fit may reach.
    probes: typical sizes from which a search starts; in units of scale (over per^per_power).
    scale: what the probes are fractions of.
    per: second scale, by which the first is divided: FORCE per CART_SPEED for a viscous
        coefficient.
    per_power: exponent of per.
    shape: True for where or how (a period, a place, a limit), False for how much.
    most: largest value that a fit may reach, in units of scale; beyond it the parameter shows
        nothing of the effect.
    fewest: smallest value that a fit may reach, in units of scale; below it the recording has
        hardly a sample of the effect.
    least: distance from neutral below which a size means nothing, for the simulation is no finer.
    jumps: share of its value to which a fit tells the parameter, because a run jumps with it.
    located: True for an instant that is read off the recording, to a sample, and not fitted: a
        run jumps with it.
    instant: True for an instant, s, from which on the motion is another: windows of a fit that
        keep away from it do not tell it.
    delays: True for a time, s, by which the motion follows the command later.
    holds: True for a level of dry friction that holds its joint at rest at any place.
    phase: True for the phase of a wave, rad: a wave that may have any phase is not surely there.
    resonant: True for the period of a resonance: the effect is in no proportion to it.
    confines: True for a shape at whose largest the effect is a simpler effect: a patch as wide as
        the rail, a friction that levels off nowhere.
    idle_beyond: scale from which on the effect does nothing: a limit above the largest command.
    optional: True for a value that a twin file may leave out; it is then neutral.
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
    jumps: float = 0.0
    located: bool = False
    instant: bool = False
    delays: bool = False
    holds: bool = False
    phase: bool = False
    resonant: bool = False
    confines: bool = False
    idle_beyond: Scale | None = None
    optional: bool = False


@dataclass(frozen=True)
class Reaction:
    """Describe how the cart's motion acts back on a drive with a mass of its own.

    The law of the FILTER takes the cart for free. Other forces on the cart (of the pole, of
    friction) move the drive's mass too, through what joins it to the cart. The join is linear, so
    that what they do adds to what the command does.

    share: share(*parameters) -> the share of all that moves along the rail that is the drive's
        own mass; 0 where the effect is off.
    law: law(push, lag, slope, h, *parameters) -> lag, slope, pull, once a substep of h s behind
        its end. push: mean over the substep of the other forces on the cart, N. lag (N) and slope
        (N/s): what the join remembers, 0 at first. pull: mean over the next substep of what the
        join makes of these forces, N; it equals them where they change slowly.
    """

    share: Callable[..., Any]
    law: Callable[..., Any]


@dataclass(frozen=True)
class Effect:
    """Describe one piece of physics beyond the base model.

    name: the catalogue's name, also in twin files and verdicts.
    place: where in the chain it acts.
    form: how the law is called.
    law: plain Python on numbers, compiled into the kernel; see `Form`. The law of an effect
        without parameters gets one number, 1 for on and 0 for off.
    sentence: what it does, for a person, with the parameters' names in braces.
    source: where the formula is from.
    parameters: in the order in which the law takes them.
    constants: names of the rig's numbers (`parameter_vector.BASE`) that the law takes before its
        parameters.
    inverse: of a MEASURE law: measured state to true state, with the law's arguments, and compiled
        as the law is. Of a FILTER law without memory: inverse(u, t, *parameters), the command that
        gives u, or the nearest.
    reaction: of a FILTER law of the drive: how the cart acts back on it; None for a drive that
        has no mass of its own.
    memory: of a FILTER law: how many numbers it keeps from substep to substep, given the substep h
        in s. They start as zeros; memory[0] stays 0 until the law has been called once.

    What a search asks:
    searched: False for an effect that describes a simulation and is no hypothesis about a rig.
    simpler: names of effects that this effect contains as special cases; a search falls back to
        them.
    becomes: names of effects that this effect looks like at an end of its range: a patch as wide
        as the rail is friction everywhere. Telling the two apart gains nothing.
    law_kind: name of the kind of measured law whose curves hold this effect as a special case; ""
        for none. Beside such a law the effect has its shape as far as the law adds little, unless
        it has `law_parts`.
    law_parts: parts of such a curve that are this effect by definition, whatever the rest of the
        curve is (mean, slope, sine, cosine): where a twin has both, the curve is without them.
    shows_as: name of the effect from which no motion of any rig can separate this effect; a search
        names that effect, and this effect beside it.
    shows_as_with: names of the rig's constants that differ between the two twins that move alike.
        Where a constant of these is known, motion can separate the two.
    separated_by: what would separate it from `shows_as`, as a clause for a person.
    set_at_start: True for what the rig sets anew each time that it is switched on.
    acts_beside: name of an effect without which (or without another of its form and place) this
        effect changes nothing.
    needs_both_joints: True for what neither a cart alone nor a pole alone can show.
    read_off: True where a detector reads the size off the recording, and a step along the
        linearised law would lead away from it.

    What simulations, controllers and watches ask:
    of_recording: True for what a recording shows and the rig does not keep: a slip at an instant,
        a start that belongs to another run. Live twins, training and the watch leave it out.
    rig_after: rig_after(rig, *parameters) returns the rig as an effect of a recording leaves it: a
        load that was put on stays on. None where nothing of the effect stays.
    timed: True for a law of the time since the recording began; what runs on for hours leaves it
        out.
    smooth: True for a law of command, drive, joints or clock whose derivative at rest stands for
        it: linear models of the rig keep it. False for sensors, which an observer undoes.
    winds: True for a law that differs from one turn of the pole to the next.
    of_joint: of a MEASURE law: "cart" or "pole", the joint whose position and rate alone it reads
        and changes; "" for any. What the cart remembers of its path depends on no sensor of the
        pole.
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
    reaction: Reaction | None = None
    searched: bool = True
    simpler: tuple[str, ...] = ()
    becomes: tuple[str, ...] = ()
    law_kind: str = ""
    law_parts: tuple[str, ...] = ()
    set_at_start: bool = False
    shows_as: str | None = None
    shows_as_with: tuple[str, ...] = ()
    separated_by: str = ""
    acts_beside: str | None = None
    needs_both_joints: bool = False
    read_off: bool = False
    of_recording: bool = False
    rig_after: Callable[..., Rig] | None = None
    timed: bool = False
    smooth: bool = False
    winds: bool = False
    of_joint: str = ""

    @property
    def sizes(self) -> tuple[Parameter, ...]:
        """Return the parameters that say how much, in their order; the others are shapes."""
        return tuple(p for p in self.parameters if not p.shape)

    @property
    def is_switch(self) -> bool:
        """Return whether the effect is on or off, without a size: a sign."""
        return not self.parameters

    @property
    def is_static(self) -> bool:
        """Return whether the effect bends the command at once: a FILTER that remembers nothing."""
        return self.memory is not None and self.memory(HALF_STEP_S) == 0

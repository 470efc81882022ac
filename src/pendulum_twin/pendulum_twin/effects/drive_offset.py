"""The drive's zero is off: it pushes the cart where the command is 0.

With a drive of constant gain this is the force of a tilted rail. Where the gain changes, the
current is limited or a load is put on, the two rigs move differently; a verdict calls the two
inseparable there as well.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(u, memory, h, t, offset):
    """Return u with the offset."""
    return u + offset


def inverse(u, t, offset):
    """Return u without the offset."""
    return u - offset


EFFECT = Effect(
    name="drive_offset",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(Parameter("offset", "1", 0.0, -1e6, 1e6, (0.05,), Scale.COMMAND),),
    sentence="The drive's zero is off: it acts as if the command were larger by {offset}.",
    source="offset of an amplifier's input; Horowitz and Hill, The Art of Electronics (2015), "
    "section 4.4",
    shows_as="rail_tilt",
    separated_by="the rail turned end for end would: a tilt then pulls the other way",
)

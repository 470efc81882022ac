"""The first samples belong to another run: the command does not act yet.

A diagnosis looks for it before anything is fitted (`data_quality`, kind stale), for no physics
repairs such samples.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(u, memory, h, t, seconds):
    """Return nothing of the command before that time, all of it afterwards."""
    return u * (t + 0.5 * h >= seconds)


EFFECT = Effect(
    name="stale_start",
    place=Place.CLOCK,
    form=Form.FILTER,
    law=law,
    memory=lambda h: 0,
    parameters=(Parameter("seconds", "s", 0.0, 0.0, 1e6, (0.5,), shape=True),),
    sentence="The first {seconds} do not belong to this run.",
    source="logging that starts before the drive does, as in recordings of a Quanser cart-pole "
    "(Muratore, TU Darmstadt)",
    of_recording=True,
    searched=False,
    timed=True,
)

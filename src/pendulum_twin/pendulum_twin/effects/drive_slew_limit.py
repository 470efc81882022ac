"""The drive's force changes no faster than at a limit: an amplifier's ramp, a firmware's."""

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place, Scale

SHORTEST_S = 1e-9


def law(u, memory, h, t, ramp_s):
    """Return the mean over this substep of the command as the ramp lets it pass.

    memory: whether the law has been called, and the end of the ramp; u is held over the substep.
    """
    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1] = u
    if ramp_s < SHORTEST_S:
        memory[1] = u
        return u
    behind, step = u - memory[1], h / ramp_s
    if abs(behind) > step:
        way = step if behind > 0.0 else -step
        mean = memory[1] + 0.5 * way
        memory[1] += way
        return mean
    memory[1] = u
    return u - 0.5 * behind * abs(behind) / step  # a triangle, until the ramp arrives


EFFECT = Effect(
    name="drive_slew_limit",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    memory=lambda h: 2,
    parameters=(
        # the probes are times to the largest command; in most s a ramp arrives at none
        Parameter(
            "ramp_s",
            "s",
            0.0,
            0.0,
            1e6,
            (0.05, 0.2),
            per=Scale.COMMAND,
            most=2.0,
            least=HALF_STEP_S,
        ),
    ),
    sentence="The drive's force changes no faster than from none to that of a command of 1 in "
    "{ramp_s}.",
    source="limit of the rate of change, held commands; J. Sachs, Slew Rate Limiters: Nonlinear "
    "and Proud of It! (embeddedrelated.com, 2014), section I",
)

"""The belt is slack: when the force turns round, the motor crosses a gap before it pulls again.

The cart does not enter: it coasts meanwhile, and the gap is crossed by a motor that is much
lighter than what it pulls.
"""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place

# The motor's mass as the belt feels it, as a share of all that moves. It is not known in general,
# so a gap is known only for this share: what shows in a motion is the time of crossing.
MOTOR_PART = 0.1
LEAST_M = 1e-5  # a motor that pulls with 90 m/s^2 crosses a shorter gap within half a step


def law(u, memory, h, t, mass_kg, force_per_pwm_n, gap_m):
    """Return the mean over this substep of the command that reaches the cart.

    memory: 1 after the first call; the motor's place in the gap, m (0 pulls the negative way,
    gap_m the positive way); its speed, m/s.
    """
    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1] = gap_m if u > 0.0 else 0.0
    push = u * force_per_pwm_n
    if gap_m <= 0.0 or (push >= 0.0 and memory[1] >= gap_m) or (push <= 0.0 and memory[1] <= 0.0):
        memory[2] = 0.0
        return u
    acceleration = push / (MOTOR_PART * mass_kg)
    speed = memory[2] + acceleration * h
    place = memory[1] + (memory[2] + 0.5 * acceleration * h) * h
    if 0.0 < place < gap_m:
        memory[1] = place
        memory[2] = speed
        return 0.0
    side = gap_m if place >= gap_m else 0.0
    way = side - memory[1]
    # the first root of way = speed t + acceleration t^2 / 2; way and its end speed have one sign
    end_speed = math.copysign(math.sqrt(max(memory[2] ** 2 + 2.0 * acceleration * way, 0.0)), way)
    mean_speed = 0.5 * (memory[2] + end_speed)
    left = 1.0 - min(max(way / mean_speed, 0.0), h) / h if mean_speed != 0.0 else 0.0
    memory[1] = side
    memory[2] = 0.0
    pulls = (side > 0.0) == (push > 0.0)
    return left * u if pulls else 0.0


EFFECT = Effect(
    name="belt_backlash",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    memory=lambda h: 3,
    constants=("mass_kg", "force_per_pwm_n"),
    parameters=(Parameter("gap_m", "m", 0.0, 0.0, 0.1, (0.001, 0.004), least=LEAST_M),),
    sentence="The belt's slack of {gap_m} has to be crossed each time that the force turns round.",
    source="dead-zone model of backlash; Nordin and Gutman, Automatica 38 (2002) 1633, section 2",
)

"""Why the driver sends what it sends: each decision's reason, with a sentence for a person."""

from __future__ import annotations

from enum import Enum

from pendulum_twin.emergency_stop import StopAnswer
from pendulum_twin.health import Level


class Reason(Enum):
    """Name why a command is changed, or where a reset or a stop stands; see `sentence`."""

    STOPPED = (Level.WARN, StopAnswer.STOPPED.value)
    DROPPED = (
        Level.WARN,
        "A command came during the emergency stop and was dropped; it will not be sent later.",
    )
    STOP_CLEARED = (Level.OK, StopAnswer.CLEARED.value)
    NOT_STOPPED = (Level.OK, StopAnswer.NOT_STOPPED.value)
    ZERO_FIRST = (Level.WARN, StopAnswer.ZERO_FIRST.value)

    NO_SAMPLE_YET = (
        Level.ERROR,
        "The rig has not sent a sample yet: PWM is 0. Is it on, and does it send to this port?",
    )
    RIG_SILENT = (Level.ERROR, "The rig has fallen silent: PWM is 0 until it sends samples again.")
    NO_COMMAND_YET = (
        Level.OK,
        "No command has come since the start, the last stop or the last reset: PWM is 0.",
    )
    COMMAND_OLD = (Level.ERROR, "The last command is too old: PWM is 0 until the next one.")

    STOOD_STILL = (
        Level.WARN,
        "A command came late, or may have (this computer stood still, or the driver was not "
        "active yet), and was dropped; the next command counts.",
    )

    INACTIVE = (
        Level.WARN,
        "The driver is not active: PWM is 0, and commands are dropped until it is activated.",
    )

    TWO_WRITERS = (
        Level.ERROR,
        "Two nodes send commands at the same time: PWM is 0, and both are dropped until one has "
        "been silent for 0.5 s.",
    )

    NO_LAST_WORD = (
        Level.ERROR,
        "The process that sends PWM 0 when the driver is killed has ended: PWM is 0 until another "
        "one is ready.",
    )
    LAST_WORD_SILENT = (
        Level.WARN,
        "The process that sends PWM 0 when the driver is killed does not answer: PWM is 0 until "
        "it answers, or another one is ready.",
    )

    FAILED = (
        Level.ERROR,
        "The driver itself failed: PWM is 0 until the next command. Its log says what failed.",
    )

    RAIL_BRAKING = (
        Level.WARN,
        "The cart comes too near the end of the rail: it is braked or sent back to the middle.",
    )
    RAIL_NOT_HELD = (
        Level.ERROR,
        "The cart does not come away from the end of the rail though it is pushed: PWM is 0. Move "
        "it to the middle by "
        "hand, and check that a positive command moves it the positive way.",
    )
    CART_DOUBTED = (
        Level.WARN,
        "The cart has moved against its pushes: PWM is 0 near the end of the rail, until pushes "
        "both ways have shown which way a positive command moves the cart. Move it to the middle "
        "by hand, and check the cart's encoder and the wires of the drive.",
    )
    CART_MIRRORED = (
        Level.WARN,
        "A positive command moves the measured cart the other way than the twin file says: the "
        "rail guard goes by the motion. Check the cart's encoder and the wires of the drive; a "
        "twin file with cart_sign_inverted or input_sign_inverted says so from the start.",
    )

    COMMAND_NOT_FINITE = (
        Level.WARN,
        "A command was NaN or infinite and was refused; the one before still holds.",
    )
    SAMPLE_NOT_FINITE = (
        Level.WARN,
        "A sample of the rig held NaN, infinity or an absurdly large number and was refused.",
    )
    ENCODER_SPIKE = (
        Level.WARN,
        "A position jumped further than the rig can move: PWM is 0 until it is back. If this "
        "comes often, check the "
        "encoders' cables.",
    )
    ENCODER_JUMPED = (
        Level.ERROR,
        "A position jumped further than the rig can move, and stayed there: PWM is 0. Check the "
        "encoders' cables, zero "
        "both encoders (cart in the middle, pole hanging still), then stop and clear the stop.",
    )
    CART_STUCK = (
        Level.ERROR,
        "The cart's position does not change at all though the drive, or the velocity reported "
        "with it, must change it: "
        "PWM is 0. Check the cart's encoder, that the drive is on and that the cart is free, then "
        "stop and clear the stop.",
    )
    POLE_STUCK = (
        Level.ERROR,
        "The pole's angle does not change at all though the cart's motion, or the rate reported "
        "with it, must change it: "
        "PWM is 0. Check the pole's encoder and that the pole is free, then stop and clear the "
        "stop.",
    )
    OVER_LIMIT = (Level.OK, "The command is larger than the limit and was clipped.")
    TOO_FAST = (
        Level.OK,
        "The command changes faster than the slew limit and follows at that rate.",
    )

    RESETTING = (Level.OK, "A reset is under way: it drives the cart, and commands are dropped.")
    RESET_DONE = (Level.OK, "The pendulum hangs at rest in the middle of the rail.")
    RESET_LATE = (
        Level.WARN,
        "The reset was given up: the pendulum did not come to rest before the deadline. Check "
        "that the pole swings and "
        "the cart runs freely, and that hanging reads pi.",
    )
    RESET_STOPPED = (
        Level.WARN,
        "The reset was given up: the emergency stop is latched. Clear it, then reset again.",
    )
    RESET_INACTIVE = (
        Level.WARN,
        "The reset was given up: the driver is not active. Activate it, then reset again.",
    )
    RESET_SILENT = (
        Level.ERROR,
        "The reset was given up: the rig is silent. See that it sends samples, then reset again.",
    )
    RESET_FAILED = (
        Level.ERROR,
        "The reset was given up: the driver itself failed. Its log says what failed.",
    )
    RESET_ENDED = (Level.WARN, "The reset was given up: the driver ends.")
    ZERO_WRONG = (
        Level.ERROR,
        "The reset was given up: the pole is at rest, but its angle is not pi. If it hangs, the "
        "encoder was zeroed "
        "wrongly: zero it while the pole hangs still. If it stands upright by friction, push it.",
    )

    @property
    def level(self) -> Level:
        """How severe the reason is."""
        return self.value[0]

    @property
    def sentence(self) -> str:
        """The sentence for a person."""
        return self.value[1]


def find_worst_level(reasons: tuple[Reason, ...]) -> Level:
    """Return the worst level among the reasons; OK without reasons."""
    return max((reason.level for reason in reasons), default=Level.OK)

"""All that can be wrong with a rig's connection, how bad it is, and what to do about it."""

from __future__ import annotations

from enum import Enum

SET_RATE = "Give --rate (and the nodes' rate) what the rig really does, or set the rig's timer."
USE_CABLE = "Use a cable, not Wi-Fi; see whether the rig's program always keeps its period."


class Verdict(Enum):
    """The result of a check; after a FAIL nothing should run on the rig before it is mended."""

    OK = "nothing to do"
    WARN = "works, but not as well as it could"
    FAIL = "does not work"
    SKIPPED = "not looked at"


class Fault(Enum):
    """What is wrong; see `verdict` and `advice`."""

    HOST_UNKNOWN = (
        Verdict.FAIL,
        "Give --rig a host name that this machine knows, or an IPv4 address.",
    )
    LOOPBACK_MIXED = (
        Verdict.FAIL,
        "One end is this machine alone, the other is not, so no packet passes: give --listen "
        "this machine's address in the rig's network (0.0.0.0:PORT for all), and let the rig "
        "send there.",
    )
    PORT_TAKEN = (
        Verdict.FAIL,
        "Most likely a driver_node is running: end it, or ask its /diagnostics instead; or give "
        "--listen another port, and let the rig send there.",
    )
    PORT_REFUSED = (
        Verdict.FAIL,
        "Give --listen an address of this machine and a port from 1024 on.",
    )
    NOBODY_LISTENS = (
        Verdict.FAIL,
        "Start the rig's program (or rig_emulator), and check the port in --rig; commands arrive"
        " nowhere now.",
    )
    NOT_CONNECTED = (Verdict.FAIL, "Start the rig's program, and check host and port in --rig.")

    SILENT = (
        Verdict.FAIL,
        "Is the rig's program running, and does it send to this machine's address and the port "
        "in --listen? On a network: does a firewall let UDP in on that port, and do both ends "
        "answer ping?",
    )
    FELL_SILENT = (
        Verdict.FAIL,
        "Look at the rig's program, its power and the cable: it stopped sending.",
    )
    ALL_FOREIGN = (
        Verdict.FAIL,
        "If that host is the rig, give it in --rig; if not, stop what sends from there.",
    )
    SOME_FOREIGN = (
        Verdict.WARN,
        "They are dropped. Stop what sends from there, or give --listen another port.",
    )
    WRONG_LENGTH = (
        Verdict.FAIL,
        "Set the byte mask of the rig's program to >dddd: pole angle, pole rate, cart position, "
        "cart velocity, each a big-endian double, nothing else.",
    )
    BYTES_SWAPPED = (
        Verdict.FAIL,
        "Set the byte order of the rig's program to big-endian (mask >dddd; network order), for "
        "commands as well (>dd).",
    )
    NOT_FINITE = (
        Verdict.FAIL,
        "The rig's program computes NaN or infinity: look at its encoders and its divisions by "
        "time.",
    )
    SOME_MALFORMED = (
        Verdict.WARN,
        "They are dropped. Does another program of that host send to this port?",
    )
    FIELDS_MIXED = (
        Verdict.FAIL,
        "Send the fields in the order pole angle, pole rate, cart position, cart velocity.",
    )

    RATE_OFF = (Verdict.WARN, SET_RATE)
    RATE_WRONG = (Verdict.FAIL, SET_RATE)
    BURSTS = (
        Verdict.WARN,
        "Something between collects samples: a coarse timer in the rig's program, a serial "
        "adapter's latency timer, or TCP without TCP_NODELAY.",
    )
    JITTER = (
        Verdict.WARN,
        "Is a computer on the way busy, or saving power, or on Wi-Fi? Use a cable; give the "
        "rig's program a higher priority.",
    )
    SOME_LOST = (Verdict.WARN, USE_CABLE)
    MANY_LOST = (Verdict.FAIL, USE_CABLE)

    MOVING = (
        Verdict.WARN,
        "Hold the pole until it hangs still, and start again. A cart that rolls by itself wants "
        "a level rail; if nothing moves, an encoder drifts.",
    )
    NOISY = (
        Verdict.WARN,
        "Look at the encoders' cables and shielding, and whether the angle is read from an "
        "analogue sensor.",
    )
    SPIKES = (
        Verdict.WARN,
        "Look at the encoders' plugs, and whether the rig's program reads a counter while it "
        "changes.",
    )
    VELOCITY_AT_REST = (
        Verdict.FAIL,
        "Velocities have to be 0 at rest: see that the rig's program differentiates positions, "
        "and that no field is mistaken.",
    )

    HANGS_AT_ZERO = (
        Verdict.FAIL,
        "Angle 0 is upright: let the rig's program add pi, or zero its encoder accordingly.",
    )
    DEGREES = (Verdict.FAIL, "Send rad and rad/s, not degrees.")
    WRAPPED = (Verdict.FAIL, "Send the angle as it is counted, without wrapping it into one turn.")
    TURNED = (
        Verdict.WARN,
        "Hanging is pi: the pole has made whole turns since the rig's program was started, or "
        "the program takes pi away; start it while the pole hangs.",
    )
    ZERO_OFF = (
        Verdict.WARN,
        "Zero the encoder while the pole hangs still, or state the offset in the twin file "
        "(effect angle_offset); sysid measures it.",
    )
    ZERO_WRONG = (
        Verdict.FAIL,
        "Let the pole hang still and zero its encoder so that this reads pi.",
    )
    OFF_MIDDLE = (
        Verdict.WARN,
        "If the cart stands in the middle, zero its encoder there; if not, move it there by hand"
        " and start again.",
    )
    BEYOND_RAIL = (
        Verdict.FAIL,
        "Zero the cart's encoder in the middle of the rail, and compare rail_half_length_m in "
        "the twin file with the rail.",
    )
    MILLIMETRES = (Verdict.FAIL, "Send m and m/s, not millimetres.")

    CART_STANDS = (
        Verdict.FAIL,
        "Is the motor's power on, its emergency stop released, its enable set? Do commands (mask"
        " >dd, big-endian) arrive at the rig? Does the cart run freely by hand?",
    )
    CART_BLIND = (
        Verdict.FAIL,
        "The pole shows that the cart moves, and the cart's encoder does not: look at its cable "
        "and coupling.",
    )
    STIFF = (
        Verdict.WARN,
        "Clean rail and belt, or look for a dead zone of the drive; sysid measures both.",
    )
    MOTION_BROKEN_OFF = (
        Verdict.FAIL,
        "Put the cart in the middle, see that it runs freely, and start again.",
    )
    JUMPED = (
        Verdict.FAIL,
        "Look at the encoders' plugs and at how the rig's program counts; zero both encoders.",
    )
    VELOCITY_WRONG = (
        Verdict.FAIL,
        "Send the position's own derivative, in m/s and rad/s: check unit, sign and the time by "
        "which differences are divided.",
    )
    COMMAND_MIRRORED = (
        Verdict.FAIL,
        "Swap the motor's two wires, or turn the command's sign in the rig's program; or state "
        "input_sign_inverted in the twin file.",
    )
    CART_MIRRORED = (
        Verdict.FAIL,
        "Swap the channels A and B of the cart's encoder, or turn its sign in the rig's program;"
        " or state cart_sign_inverted in the twin file.",
    )
    ANGLE_MIRRORED = (
        Verdict.FAIL,
        "Swap the channels A and B of the pole's encoder, or turn its sign in the rig's program;"
        " or state angle_sign_inverted in the twin file.",
    )
    POLE_STANDS = (
        Verdict.FAIL,
        "Does the pole swing freely? Look at its encoder's cable and coupling.",
    )
    SLOW_ANSWER = (
        Verdict.WARN,
        "The rail guard reckons with 20 ms. Look for buffers in the rig's program and drive; "
        "state input_delay in the twin file.",
    )
    GAIN_OFF = (
        Verdict.WARN,
        "The twin file does not describe this rig well: record an excitation and run sysid "
        "diagnose.",
    )
    GAIN_UNSAFE = (
        Verdict.FAIL,
        "The rail guard, which takes force and mass from the twin file, cannot be trusted so: "
        "correct force_per_pwm_n or the masses. A factor of 100 or 1000 is a wrong unit of the "
        "position.",
    )
    CLIPPED = (
        Verdict.WARN,
        "The drive gives no more than that: lower pwm_limit in the twin file, or state "
        "input_saturation; see the motor's supply.",
    )
    RESET_IGNORED = (
        Verdict.FAIL,
        "The rig's program does not act on the second number of a command (mask >dd). The "
        "driver_node's own reset works without it.",
    )
    RESET_LATE = (
        Verdict.FAIL,
        "The rig's swing-down does not come to rest: check its gains and signs. The "
        "driver_node's own reset works without it.",
    )

    @property
    def verdict(self) -> Verdict:
        """Return how bad it is."""
        return self.value[0]

    @property
    def advice(self) -> str:
        """Return what to do."""
        return self.value[1]

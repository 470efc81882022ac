"""The report's fixed words: what each outcome means, what things are called, and what the numbers are."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid.records import Outcome


@dataclass(frozen=True)
class OutcomeWords:
    """Say an outcome: a sign and title for the badge, a sentence, and what an empty or filled list of effects means."""

    sign: str
    title: str
    meaning: str
    when_empty: str
    when_listed: str = "Physics that the recording shows and the twin as given did not have. The improved twin holds it."


OUTCOMES: dict[Outcome, OutcomeWords] = {
    Outcome.NAMED: OutcomeWords(
        "✓",
        "Missing physics named",
        "The twin left physics out, and the catalogue of effects has it.",
        "None is listed, although the outcome says that physics was left out: the verdict is incomplete.",
    ),
    Outcome.NOTHING_MISSING: OutcomeWords(
        "=",
        "Nothing missing",
        "The twin has all the physics that this recording shows; other values of its parameters are enough.",
        "None. With refitted parameters alone the twin runs as well as a right model would. An effect too weak to show "
        "in this recording cannot be excluded.",
    ),
    Outcome.AMBIGUOUS: OutcomeWords(
        "?",
        "More than one explanation",
        "The twin left physics out, and this recording cannot tell which of several effects it is.",
        "None can be named: several effects explain this recording equally well. The hypotheses below show which.",
        "The best explanation found, which the improved twin holds. What stands in the last column does as well on "
        "this recording.",
    ),
    Outcome.NOT_IN_CATALOGUE: OutcomeWords(
        "!",
        "Not in the catalogue",
        "The twin left physics out that no effect of the catalogue explains; where it acts and what it looks like was "
        "measured.",
        "None of the catalogue's effects. What is missing was not forced onto the nearest name: its place, the "
        "variable that it depends on and its measured shape stand under “Where the mismatch lives”.",
    ),
    Outcome.UNUSABLE: OutcomeWords(
        "×",
        "Recording unusable",
        "This recording cannot answer the question, whatever the twin: its data must be put right first.",
        "Not asked: the recording cannot answer the question. The data quality below says why.",
    ),
}
UNKNOWN = OutcomeWords(
    "?", "No outcome", "The verdict does not say how the diagnosis ended.", "None listed."
)

PLACES: dict[str, str] = {
    "command": "what the input goes through before the drive",
    "drive": "the motor and the belt",
    "cart": "forces on the cart",
    "pole": "torques on the pole",
    "sensor": "how positions and angles are measured",
    "clock": "when samples were taken",
}
FORCE_PLACES = ("command", "drive", "cart")

VARIABLES: dict[str, tuple[str, str]] = {  # variable of an evidence -> its words and unit
    "cart_position": ("cart position", "m"),
    "cart_velocity": ("cart velocity", "m/s"),
    "cart_acceleration": ("cart acceleration", "m/s^2"),
    "pole_angle": ("pole angle", "rad"),
    "pole_rate": ("pole rate", "rad/s"),
    "pole_velocity": ("pole rate", "rad/s"),
    "pole_acceleration": ("pole acceleration", "rad/s^2"),
    "command": ("command", "PWM"),
    "pwm": ("command", "PWM"),
    "command_rate": ("rate of the command", "PWM/s"),
    "command_history": ("past of the command", "s"),
    "force": ("drive force", "N"),
    "time": ("time", "s"),
    "time_shift": ("time between the channels", "s"),
    "frequency": ("frequency", "Hz"),
    "constant": ("always the same", ""),
    "pole_turns": ("pole angle, turns counted", "rad"),
    "lag": ("time since a step of the command", "s"),
    "way": ("way since the cart turned round", "m"),
    "turn": ("way since the pole turned round", "rad"),
}

RIG_PARAMETERS: dict[str, str] = {
    "cart_mass_kg": "mass of the cart",
    "pole_mass_kg": "mass of the pole",
    "com_distance_m": "distance of the centre of mass from the axis",
    "pole_inertia_kg_m2": "inertia of the pole about its axis",
    "gravity_m_s2": "gravity",
    "force_per_pwm_n": "force of the drive for full PWM",
    "cart_viscous_n_s_m": "viscous friction of the cart",
    "pole_viscous_n_m_s": "viscous friction of the pole",
    "rail_half_length_m": "half length of the rail",
    "pwm_limit": "limit of the command",
}

QUALITY: dict[str, str] = {
    "spike": "single samples far off their neighbours; left out",
    "gap": "samples missing; nothing is carried across",
    "jitter": "stamps not evenly spaced",
    "wrap": "jumps of the angle by a full turn; unwrapped",
    "stale": "the same value repeated while the rig moved; left out",
    "clipped": "values stuck at a limit",
}

FIT_ROWS: dict[str, tuple[str, str]] = {  # key of the verdict's fit -> its words and unit
    "train": ("windows that the fit used", ""),
    "choose": ("windows that chose between hypotheses", ""),
    "held_out": ("held-out windows, seen by neither", ""),
    "held_out_cart_mm": ("held-out windows, cart", "mm"),
    "held_out_pole_rad": ("held-out windows, pole", "rad"),
    "held_out_cart_m": ("held-out windows, cart", "m"),
    "train_cart_mm": ("windows that the fit used, cart", "mm"),
    "train_pole_rad": ("windows that the fit used, pole", "rad"),
}

DEFINITIONS: tuple[tuple[str, str], ...] = (
    (
        "Window",
        "One short stretch of the recording in which the twin runs freely: it starts where the rig was, gets the "
        "recorded command, and is never corrected on the way.",
    ),
    (
        "Fitted, chosen, held out",
        "Every window belongs to one of three parts. Parameters are fitted on the first, hypotheses are compared on "
        "the second, and the third judges the result: neither fitting nor choosing has seen it.",
    ),
    (
        "Score, misfit",
        "Root mean square error of the free runs in units of the sensors' noise, cart and pole together. 1 is as good "
        "as the sensors can show; 10 is ten times their noise.",
    ),
    (
        "Noise floor",
        "The score that a right model reaches on this recording. Only what exceeds it counts.",
    ),
    (
        "Before, after",
        "The twin as it was given, and the improved twin: parameters refitted and missing effects added.",
    ),
    (
        "[low, high]",
        "95 % interval: the recording speaks against values outside it. It holds for the model named here; a model "
        "that lacks an effect can be confidently wrong.",
    ),
    (
        "Confidence",
        "How sure it is that this effect, and no other that the recording can part from it, is there.",
    ),
    (
        "Cannot be told from",
        "Effects that move the rig in the same way in this recording, so that it cannot decide between them.",
    ),
    (
        "Share",
        "The part of the missing force and torque that one variable accounts for, each measured against what moves its "
        "joint: all shares together are 100 % at most, and noise has none.",
    ),
    (
        "Product (×)",
        "A coefficient that varies: force per command, dry or viscous friction, or a sensor's error, and what changes it.",
    ),
    (
        "Identifiable",
        "Whether this recording fixes the value. Motion fixes ratios only, such as force to mass: the cart's mass "
        "stays as measured, and sets the scale for the rest.",
    ),
    (
        "Masking",
        "A parameter that had taken on a wrong value to make up for physics that was left out.",
    ),
    (
        "Signs",
        "Cart: positive along the rail, 0 in the middle. Pole: 0 upright, counterclockwise positive, hanging at π, not "
        "wrapped.",
    ),
)

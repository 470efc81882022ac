"""The fixed words of the report: the outcomes, the names of variables, and what numbers mean."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_sysid.records import FaultKind, Outcome


@dataclass(frozen=True)
class OutcomeWords:
    """Hold the words of an outcome.

    sign, title: on the badge.
    meaning: one sentence.
    when_listed, when_empty: above the list of missing effects, and in its place; "" where the
        list is always empty, or never.
    """

    sign: str
    title: str
    meaning: str
    when_listed: str = ""
    when_empty: str = ""


LISTED = (
    "Physics that the recording shows and the twin as given did not have. The improved twin "
    "holds it."
)


OUTCOMES: dict[Outcome, OutcomeWords] = {
    Outcome.NAMED: OutcomeWords(
        "✓",
        "Missing physics named",
        "The twin lacks physics that the catalogue of effects has.",
        when_listed=LISTED,
    ),
    Outcome.NOTHING_MISSING: OutcomeWords(
        "=",
        "Nothing missing",
        "The twin has all the physics that this recording shows; other values of its parameters "
        "are enough.",
        when_empty="None. With refitted parameters alone the twin runs as well as a right model "
        "would. An effect too weak to show in this recording cannot be excluded.",
    ),
    Outcome.AMBIGUOUS: OutcomeWords(
        "?",
        "More than one explanation",
        "The twin lacks physics, and this recording cannot tell which of several effects it is.",
        when_listed="The best explanation, which the improved twin holds. The effects in the last "
        "column explain this recording as well.",
    ),
    Outcome.NOT_IN_CATALOGUE: OutcomeWords(
        "!",
        "Not in the catalogue",
        "The twin lacks physics that no effect of the catalogue explains. Its place and its shape "
        "are measured.",
        when_listed=LISTED,
        when_empty="None of the catalogue's effects. The report forces no name on what is "
        "missing: “Where the mismatch lives” shows its place, the variable that it depends on and "
        "its measured shape.",
    ),
    Outcome.UNUSABLE: OutcomeWords(
        "×",
        "Recording unusable",
        "This recording cannot answer the question, whatever the twin. Its data must be put right "
        "first.",
        when_empty="Not asked: the recording cannot answer the question. The sentence above and "
        "the data quality below say why.",
    ),
}

EVENTS = OutcomeWords(  # in place of "not in the catalogue"
    "!",
    "Something acted on the rig",
    "Something that is no law of the rig acted on it at a few times: a touch, a stop, a cable or "
    "a spot of the rail. No place of the chain is at fault.",
    when_listed=LISTED,
    when_empty="Nothing that the twin could hold: what it does not explain stands in a few "
    "stretches of time, and elsewhere its errors are near the noise floor.",
)

CHANGED = OutcomeWords(  # in place of "not in the catalogue"
    "!",
    "The rig changed",
    "The rig was not the same in all recordings: each by itself is explained, with other values. "
    "No single twin is right for all of them.",
    when_listed=LISTED,
    when_empty="None. What no twin explains for all recordings is what changed between them.",
)

PLACES: dict[str, str] = {
    "command": "what the input goes through before the drive",
    "drive": "the motor and the belt",
    "cart": "forces on the cart",
    "pole": "torques on the pole",
    "sensor": "how positions and angles are measured",
    "clock": "when samples were taken",
}
EVIDENCE_MEANS = (
    "Of the given twin, its parameters refitted and no effect added: the share of the force and "
    "torque that it lacks which goes with each variable. That is a relation, not a place: cart, "
    "pole and command move together, so a lag of the motor can go with the pole’s angle as well. "
    "Where effects are named, they say where the physics acts."
)
FORCE_PLACES = ("command", "drive", "cart")

# Variable or axis of an evidence -> words and unit. A twin file does not say whether its command
# is a PWM fraction, volts or newtons.
VARIABLES: dict[str, tuple[str, str]] = {
    "cart_position": ("cart position", "m"),
    "cart_velocity": ("cart velocity", "m/s"),
    "cart_acceleration": ("cart acceleration", "m/s^2"),
    "pole_angle": ("pole angle", "rad"),
    "pole_turns": ("pole angle, turns counted", "rad"),
    "pole_rate": ("pole rate", "rad/s"),
    "command": ("command", ""),
    "command_rate": ("rate of the command", "1/s"),
    "command_history": ("past of the command", "s"),
    "lag": ("time since a step of the command", "s"),
    "time": ("time", "s"),
    "time_shift": ("time between the channels", "s"),
    "frequency": ("frequency", "Hz"),
    "constant": ("always the same", ""),
    "way": ("way since the cart turned round", "m"),
    "turn": ("way since the pole turned round", "rad"),
}

RIG_PARAMETERS: dict[str, str] = {
    "com_distance_m": "distance of the centre of mass from the axis",
    "pole_inertia_kg_m2": "inertia of the pole about its axis",
    "force_per_pwm_n": "force of the drive a unit of command",
    "cart_viscous_n_s_m": "viscous friction of the cart",
    "pole_viscous_n_m_s": "viscous friction of the pole",
}

QUALITY: dict[FaultKind, str] = {
    "spike": "single samples far off their neighbours; left out",
    "gap": "samples missing; nothing is carried across",
    "jitter": "stamps not evenly spaced",
    "wrap": "jumps of the angle by a full turn; unwrapped",
    "stale": "samples that do not show how this rig moved then; left out",
    "clipped": "values stuck at a limit",
    "slip": "jumps of the cart's reading that no force explains; left out",
    "rail_end": "stretches in which the cart stands at an end of the rail; left out",
    "other_rate": "recordings of another sample rate than the first",
    "other_command": "stretches in which the driver sent other commands than were read",
    "late_command": "samples by which every command stood too late; moved back",
}

FIT_ROWS: dict[str, tuple[str, str]] = {  # field of FitScores -> words and unit
    "floors": (
        "the error that counts: median held-out window, or as “What the numbers mean” says",
        "",
    ),
    "held_out": ("held-out windows, all together", ""),
    "train": ("windows that the fit used, all together", ""),
    "held_out_cart_mm": ("held-out windows, cart", "mm"),
    "held_out_pole_rad": ("held-out windows, pole", "rad"),
    "held_out_cart_fit": ("fit (NRMSE) on held-out windows, cart", "%"),
    "held_out_pole_fit": ("fit (NRMSE) on held-out windows, pole", "%"),
}

DEFINITIONS: tuple[tuple[str, str], ...] = (
    (
        "Window",
        "A short stretch of the recording in which the twin runs freely: it starts in the state "
        "of the rig, gets the recorded command, and is never corrected.",
    ),
    (
        "Fitted, chosen, held out",
        "A quarter of the windows is held out and judges the result: neither fitting nor choosing "
        "uses it. Parameters are fitted to the others, and hypotheses are compared there by "
        "cross-validation: each window is judged by parameters that were fitted without it.",
    ),
    (
        "Error in noise floors",
        "Root mean square error of the free runs, cart and pole together in units of their "
        "sensors' noise, over the error that a perfect model reaches. 1 is perfect. The number "
        "is that of the median held-out window, for over all windows together a single window "
        "near upright, where errors grow, may weigh more than all others. It is that of all "
        "held-out windows together where nothing explains the error, or the recording does not "
        "look like its rig, and that is more. Before and after have the same measure, 1 at least.",
    ),
    (
        "Noise floor",
        "The error that a perfect model reaches on this recording, for its start states come from "
        "noisy samples. The files count it as a score, in units of the sensors' noise.",
    ),
    (
        "Fit (NRMSE)",
        "100 % minus the error of the runs over the spread of the measurement in each window. "
        "100 % is perfect, 0 % is no better than the mean of the window.",
    ),
    (
        "Before, after",
        "The twin as given, and the improved twin: parameters refitted and missing effects added.",
    ),
    (
        "[low, high]",
        "95 % interval: the recording speaks against values outside it. It holds for the model "
        "named here; a model that lacks an effect can be confidently wrong.",
    ),
    (
        "Confidence",
        "The probability that this effect is there, and no other effect that the recording can "
        "tell from it.",
    ),
    (
        "Cannot be told from",
        "Effects that move the rig in the same way in this recording, so that it cannot decide "
        "between them.",
    ),
    (
        "Share",
        "The part of the missing force and torque that one variable accounts for, each measured "
        "against what moves its joint. All shares together are 100 % at most; noise has none.",
    ),
    (
        "Product (×)",
        "A coefficient that varies, and the variable that changes it: force per command, dry or "
        "viscous friction, or the error of a sensor.",
    ),
    (
        "Identifiable",
        "Whether this recording fixes the value. Motion fixes ratios only, such as force to mass: "
        "the cart's mass stays as given, of a pole alone its inertia does, and sets the scale for "
        "the other values: they are off by as many percent.",
    ),
    (
        "Masking",
        "A parameter that had taken on a wrong value to make up for missing physics.",
    ),
    (
        "Signs",
        "Cart: positive along the rail, 0 in the middle. Pole: 0 upright, counterclockwise "
        "positive, hanging at π, not wrapped.",
    ),
)


def name_variable(name: str) -> tuple[str, str]:
    """Return a variable's words and unit; a product has the words of its factors and no unit."""
    factors = [VARIABLES.get(factor, (factor.replace("_", " "), "")) for factor in name.split("*")]
    return " × ".join(words for words, _ in factors), factors[0][1] if len(factors) == 1 else ""


def name_unexplained(place: str) -> str:
    """Return the label of an unexplained quantity that comes in at a place of the chain."""
    if place in FORCE_PLACES:
        return "unexplained force (N)"
    return "unexplained torque (N·m)" if place == "pole" else "unexplained"

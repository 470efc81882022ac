"""The sentences of a verdict: the answer, an effect with its sizes, and masked constants."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.search import Named
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.measuring.repeatability import Repeatability
from pendulum_sysid.records import Fit, Outcome
from pendulum_sysid.telling.changed_rig_text import describe_change
from pendulum_sysid.telling.events import Events
from pendulum_sysid.telling.given_values import describe_changed
from pendulum_sysid.telling.law_text import write_sentence
from pendulum_sysid.telling.likeness import (
    compute_floors,
    compute_followed_share,
    is_unlike,
)
from pendulum_sysid.telling.outcome import (
    Findings,
    compute_random_share,
    is_motion_effect,
    list_inseparable,
    runs_at_noise,
)
from pendulum_sysid.verdict.record import MissingEffect
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place

JOINTS = ("cart", "mm"), ("pole", "mrad")  # by channel; runs are in m and rad
MILLI = 1e3


def write_answer(
    outcome: Outcome,
    named: tuple[Named, ...],
    steady: tuple[MissingEffect, ...],
    findings: Findings,
    events: Events | None,
) -> str:
    """Return the answer of a diagnosis for a person.

    named: the effects that the verdict names.
    steady: dry friction that is certain although something else has no name.
    events: in which all that is unexplained stands; None for other errors.
    """
    errors = _describe_errors(findings)
    certain = "".join(f" {effect.sentence} This part is certain." for effect in steady)
    if events is not None:
        return f"{events.sentence}; {errors}.{certain}"
    if findings.change is not None:
        known = [describe_effect(effect.effect, findings.improved) for effect in named]
        change = describe_change(findings.change, findings.case.twin)
        return " ".join([change, *known, f"With one twin for all, {errors}."])
    if is_unlike(findings):
        closest, random = _describe_closest(named, findings), describe_random(findings)
        return f"{_describe_unlike(findings)}; {errors}.{closest}{random}"
    if outcome is Outcome.NOTHING_MISSING:
        return f"{describe_nothing(findings)}; {errors}.{describe_remaining(findings)}"
    if outcome is Outcome.NOT_IN_CATALOGUE:
        signs = "".join(
            f" {describe_effect(effect.effect, findings.improved)}" for effect in named
        )
        bare = not (findings.laws or named or steady or findings.given_stays)
        changed = describe_changed(findings) if bare else ""
        part = f" Other parameters{changed} explain a part of what differs." if changed else ""
        laws = "".join(f" {write_sentence(law)}" for law in findings.laws)
        place = findings.location.place
        if findings.laws:
            place = findings.laws[0].curve.kind.place.value
        return (
            f"Physics is missing at the {place} that no effect of the catalogue explains; "
            f"{errors}, {describe_size(findings, 2)}."
            f"{laws}{signs}{certain}{part}{describe_rest(findings)}"
        )
    effects = [describe_effect(effect.effect, findings.improved) for effect in named]
    with_effects = f"With {'it' if len(named) == 1 else 'them'}, {errors}."
    sentences = [*effects, *_describe_inseparable(named, findings), with_effects]
    sentences += [write_sentence(law) for law in findings.laws]
    return " ".join(sentences) + describe_remaining(findings)


def describe_nothing(findings: Findings) -> str:
    """Return the clause of a rig that lacks no effect for sure, and what its twin holds."""
    if findings.given_stays:
        return (
            "Nothing is missing: the given twin stays, for no other parameters run windows that "
            "were left out better for sure"
        )
    changed = describe_changed(findings)
    doubted = [e.effect for e in findings.perhaps if e.effect in findings.improved.effects]
    if not doubted:
        return f"Nothing is missing: other parameters of the rig are enough{changed}"
    return (
        f"Nothing is surely missing: other parameters of the rig are enough{changed}, with "
        f"effects of which none is sure ({', '.join(doubted)})"
    )


def describe_remaining(findings: Findings) -> str:
    """Return how much remains and what is known of it, after a space; empty at the noise."""
    if runs_at_noise(findings):
        return ""
    return f" What remains is {describe_size(findings)}.{describe_rest(findings)}"


def describe_size(findings: Findings, digits: int = 3) -> str:
    """Return how large the improved twin's error is, in the scale that shows it."""
    floors, whole = compute_floors(findings).after, max(findings.whole_misfits)
    if floors > decisions.FLOORS_AT_NOISE or whole <= floors:
        return f"{write_number(floors, digits)} times the noise floor"
    ratio = f"{write_number(whole, digits)} times the sensors' noise over whole windows"
    return f"{ratio} (the median window is near its noise floor)"


def describe_rest(findings: Findings) -> str:
    """Return what is known of the error that remains, after a space; empty for nothing."""
    return describe_repeats(findings.repeats) + describe_random(findings)


def describe_random(findings: Findings) -> str:
    """Return a sentence on a force that depends on nothing that was asked, after a space.

    Empty where most of what remains depends on something, and where nothing remains.
    """
    force, share = findings.wandering, compute_random_share(findings)
    if force is None or share < decisions.RANDOM_LEAST_SHARE:
        return ""
    size = f"force of {force.force_n:.3g} N on the cart"
    signals = findings.case.signals
    on_pole = findings.remains.place in ("pole", "sensor") and signals.pole is not None
    if on_pole or signals.cart is None:
        size = f"torque of {force.torque_n_m:.3g} N m on the pole"
    return (
        f" What remains is like a {size} (root mean square) that changes within "
        f"{force.correlation_s:.2g} s. {share:.0%} of it depends on nothing that was asked, and "
        "may be random."
    )


def describe_repeats(repeats: Repeatability | None) -> str:
    """Return a sentence on what comes again of the error, after a space; empty where unknown."""
    if repeats is None:
        return ""
    share, low, high = (
        write_number(100.0 * v) for v in (repeats.share, repeats.low, repeats.high)
    )
    return (
        f" Of the squared error that remains, at least {share} % [{low}, {high}] comes again with "
        "the same motion; the rest may be random."
    )


def _describe_unlike(findings: Findings) -> str:
    """Return the clause for a recording that even the improved twin does not follow."""
    ratio = compute_floors(findings).after
    far = f"is {write_number(ratio)} times its noise floor" if np.isfinite(ratio) else "diverges"
    share = compute_followed_share(findings.after["held_out"])
    return (
        "This recording does not look like this rig: the improved twin's error over "
        f"{findings.after['held_out'].seconds:.3g} s {far}, and it follows {share:.0%} of the "
        "motion"
    )


def _describe_closest(named: tuple[Named, ...], findings: Findings) -> str:
    """Return what comes closest to an explanation, none of it certain; "" for nothing."""
    effects = [describe_effect(effect.effect, findings.improved) for effect in named]
    laws = [write_sentence(law) for law in findings.laws]
    if not effects and not laws:
        changed = describe_changed(findings)
        return f" Other parameters{changed} and the effects of the catalogue do not explain it."
    return " ".join([" Closest comes, and is not certain:", *effects, *laws])


def describe_effect(name: str, fit: Fit) -> str:
    """Return the effect's sentence with its fitted sizes."""
    effect = BY_NAME[name]
    sizes = {
        p.name: f"{fit.estimates[f'{name}.{p.name}'].value:.3g} {p.unit}".replace(" 1", "")
        for p in effect.parameters
    }
    return effect.sentence.format(**sizes)


def describe_masking(named: tuple[Named, ...], findings: Findings) -> tuple[str, ...]:
    """Return a sentence for every constant that had absorbed missing physics when fitted alone."""
    sentences = []
    for parameter in list_rig_parameters(findings.case.twin):
        name = parameter.name
        alone, after = findings.base.estimates[name], findings.improved.estimates[name]
        masked = [
            effect.effect
            for effect in named
            if is_motion_effect(effect.effect) and _act_on_same_joint(name, effect.effect)
        ]
        moved = abs(alone.value - after.value) > decisions.LEAST_MASKED_CHANGE * abs(after.value)
        if masked and moved and not alone.low <= after.value <= alone.high:
            sentences.append(
                f"{name} had absorbed the missing {' and '.join(masked)}: "
                f"{write_number(alone.value)} becomes {write_number(after.value)}"
            )
    return tuple(sentences)


def write_number(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits; its whole part stands in full."""
    if not np.isfinite(value):
        return "beyond measure"
    return f"{value:.0f}" if abs(value) >= 10**digits else f"{value:.{digits}g}"


def _describe_inseparable(named: tuple[Named, ...], findings: Findings) -> list[str]:
    on_recording = [
        f"{effect.effect} cannot be told from {', '.join(effect.inseparable_from)} "
        "on this recording."
        for effect in named
        if effect.inseparable_from
    ]
    by_no_motion = []
    for effect in named:
        others = [
            e for e in list_inseparable(effect, findings) if e not in effect.inseparable_from
        ]
        if others:
            by_no_motion.append(f"No motion can tell {effect.effect} from {', '.join(others)}.")
    return [*on_recording, *by_no_motion]


def _describe_errors(findings: Findings) -> str:
    """Return the held-out errors before and after."""
    before, after = findings.before["held_out"], findings.after["held_out"]
    if np.array_equal(before.rmse, after.rmse):
        errors = zip(after.channels, after.rmse, strict=True)
        sizes = [f"{JOINTS[c][0]} {write_number(e * MILLI)} {JOINTS[c][1]}" for c, e in errors]
        return f"held-out errors over {after.seconds:.3g} s stay: {', '.join(sizes)}"
    changes = []
    for k, channel in enumerate(after.channels):
        joint, unit = JOINTS[channel]
        old, new = (write_number(runs.rmse[k] * MILLI) for runs in (before, after))
        changes.append(f"{joint} {old} -> {new} {unit}")
    fall = bool(np.all(after.rmse <= before.rmse))
    verb = "fall" if fall else "change"
    return f"held-out errors over {after.seconds:.3g} s {verb}: {', '.join(changes)}"


def _act_on_same_joint(parameter: str, effect: str) -> bool:
    acts_on_pole = BY_NAME[effect].place in (Place.POLE, Place.SENSOR)
    return acts_on_pole if parameter.startswith(("pole", "com")) else not acts_on_pole

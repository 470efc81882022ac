"""What a diagnosis says: the verdict of the contract, put together from fits and comparisons."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from pendulum_sysid.cleaning.encoder_steps import encoder_step
from pendulum_sysid.finding.localisation.shape_check import Misfit
from pendulum_sysid.finding.search import Named
from pendulum_sysid.finding.steady_friction import entry_of
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.noise_floor import NoiseFloor
from pendulum_sysid.fitting.parameters import Free, rig_parameters
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.records import Estimate, Fit, Localisation, Next, Outcome, Recording
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.parameter_vector import make_theta

SCHEMA = "pendulum_verdict/1"
NEXT_FILE = "next.yaml"
AT_FLOOR = 1.5  # misfit up to which nothing is called left
EXPLAINED = (
    0.5  # of the error's power that the effects found must take away, to be called the answer
)
SUREST = 3.0  # standard errors beyond which no confidence is claimed
MASKED = 0.05  # relative change of a parameter that is worth a sentence


@dataclass(frozen=True)
class Findings:
    """Hold what the stages found: the fit of parameters alone, the final fit, what it names, and its free runs.

    floor: what a perfect model reaches on this recording. before,
    after: free runs of the given and of the improved twin, by part ("train", "held_out"). coming:
    what to play next.
    misfits: named effects whose laws do not have the shape that is seen. outweighed: whether one
    thing that is still missing is larger than all that the names explain. whole: misfit of the
    final fit over whole choosing windows. steady: level (N) of dry friction that is there whatever
    else is missing, asked only when no effect explains that.
    """

    case: Case
    base: Fit
    best: Fit
    named: tuple[Named, ...]
    location: Localisation
    remains: Localisation
    before: dict[str, WindowRuns]
    after: dict[str, WindowRuns]
    floor: NoiseFloor
    coming: Next
    misfits: tuple[Misfit, ...] = ()
    outweighed: bool = False
    whole: float = 1.0
    steady: Estimate | None = None


def outcome_of(found: Findings) -> Outcome:
    """Return how the diagnosis ended."""
    physics = [one for one in found.named if moves(one.effect)]
    unexplained = explained(found) < EXPLAINED or found.outweighed
    if (
        found.misfits
        or (found.best.choose > AT_FLOOR and unexplained)
        or (physics and slight(found))
    ):
        return Outcome.NOT_IN_CATALOGUE
    if any(one.rivals for one in physics):
        return Outcome.AMBIGUOUS
    return Outcome.NAMED if found.named else Outcome.NOTHING_MISSING


def moves(effect: str) -> bool:
    """Return whether an effect changes how the rig moves: not a sign, not the filter of the reported velocities."""
    return bool(BY_NAME[effect].parameters) and BY_NAME[effect].form is not Form.REPORT


def ties(one: Named, found: Findings) -> list[str]:
    """Return what cannot be told from an effect: on this recording, and by no motion whatever."""
    rig = found.case.twin.rig
    whole = rig.has_cart and rig.has_pole
    return [
        *one.rivals,
        *(
            e.name
            for e in CATALOGUE
            if e.shows_as == one.effect and (whole or e.place is not Place.CLOCK)
        ),
    ]


def explained(found: Findings) -> float:
    """Return the share of the power of the errors of parameters alone that the effects found take away, choosing windows."""
    return 1.0 - min((found.best.choose / found.base.choose) ** 2, 1.0)


def slight(found: Findings) -> bool:
    """Return whether the names explain a small part only, and whole windows show what parts of them leave in the noise.

    Of a small effect that is not in the catalogue, several that are may each take a little.
    """
    return found.whole > AT_FLOOR and explained(found) < EXPLAINED


def left_over(found: Findings) -> float:
    """Return how far the improved twin is above what noise explains, 1 for not at all.

    Whether anything is left is asked of runs whose starts are refined, for noise in the starts
    drowns the rest; how much, of the median free run on the held-out windows beside that of a
    perfect model.
    """
    if found.best.choose <= AT_FLOOR:
        return 1.0
    return max(found.after["held_out"].typical / found.floor.typical, found.best.choose)


def verdict_of(found: Findings, recording: Recording, elapsed_s: float) -> dict:
    """Return the verdict of a recording that could be used."""
    outcome = outcome_of(found)
    named = tuple(
        one
        for one in found.named
        if outcome is not Outcome.NOT_IN_CATALOGUE or not moves(one.effect)
    )
    coming = None if found.coming.plan is None else {"file": NEXT_FILE, "why": found.coming.why}
    return {
        "schema": SCHEMA,
        "outcome": outcome.value,
        "sentence": _sentence(outcome, named, found),
        "location": None
        if outcome is Outcome.NOTHING_MISSING
        else _location(outcome, named, found),
        "missing_physics": [*(_missing(one, found) for one in named), *_steady(outcome, found)],
        "rig_parameters": {
            free.name: _rig_parameter(free, found) for free in rig_parameters(found.case.twin)
        },
        "masking": _masking(named, found),
        "fit": _fit(found),
        "remainder": _remainder(found),
        **_recording(recording, elapsed_s),
        "next_experiment": coming,
    }


def unusable(recording: Recording, why: str, elapsed_s: float) -> dict:
    """Return the verdict of a recording that cannot answer the question."""
    return {
        "schema": SCHEMA,
        "outcome": Outcome.UNUSABLE.value,
        "sentence": why,
        "location": None,
        "missing_physics": [],
        "rig_parameters": {},
        "masking": [],
        "fit": None,
        "remainder": None,
        **_recording(recording, elapsed_s),
    }


def _recording(recording: Recording, elapsed_s: float) -> dict:
    signals = recording.signals
    quality = [
        {
            "kind": one.kind,
            "count": one.count,
            "intervals_s": [list(pair) for pair in one.intervals_s],
        }
        for one in recording.findings
    ]
    return {
        "data_quality": quality,
        "next_experiment": None,
        "recording": {
            "name": recording.name,
            "seconds": signals.seconds,
            "samples": len(signals),
            "rate_hz": 1.0 / signals.period_s,
            "digest": recording.digest,
            "position_step_m": encoder_step(signals.cart),
            "angle_step_rad": encoder_step(signals.pole),
        },
        "elapsed_s": elapsed_s,
    }


def _sentence(outcome: Outcome, named: tuple[Named, ...], found: Findings) -> str:
    ratio = left_over(found)
    errors = _errors(found)
    if outcome is Outcome.NOTHING_MISSING:
        return f"Nothing is missing: other parameters of the rig are enough; {errors}."
    if outcome is Outcome.NOT_IN_CATALOGUE:
        signs = "".join(f" {_plain(one, found.best)}" for one in named)
        certain = "".join(
            f" {one['sentence']} This part is certain." for one in _steady(outcome, found)
        )
        return (
            f"Physics is missing at the {found.location.place} that no effect of the catalogue explains; {errors}, "
            f"{ratio:.2g} times the noise floor.{signs}{certain}"
        )
    effects = " ".join(_plain(one, found.best) for one in named)
    tied = [
        f"{one.effect} cannot be told from {', '.join(one.rivals)} on this recording."
        for one in named
        if one.rivals
    ]
    alike = {one.effect: [e for e in ties(one, found) if e not in one.rivals] for one in named}
    tied += [
        f"No motion can tell {name} from {', '.join(others)}."
        for name, others in alike.items()
        if others
    ]
    left = [f"What remains is {_number(ratio)} times the noise floor."] if ratio > AT_FLOOR else []
    return " ".join(
        [effects, *tied, f"With {'it' if len(named) == 1 else 'them'}, {errors}.", *left]
    )


def _errors(found: Findings) -> str:
    """Return the held-out errors before and after, for a person."""
    parts = []
    before, after = found.before["held_out"], found.after["held_out"]
    for k, channel in enumerate(after.channels):
        name, unit, scale = (("cart", "mm", 1e3), ("pole", "mrad", 1e3))[channel]
        parts.append(
            f"{name} {_number(before.rmse[k] * scale)} -> {_number(after.rmse[k] * scale)} {unit}"
        )
    return f"held-out errors over {after.seconds:.3g} s fall: {', '.join(parts)}"


def _plain(one: Named, best: Fit) -> str:
    """Return the effect's sentence with its fitted sizes."""
    effect = BY_NAME[one.effect]
    values = {
        p.name: f"{best.estimates[f'{one.effect}.{p.name}'].value:.3g} {p.unit}".replace(" 1", "")
        for p in effect.parameters
    }
    return effect.sentence.format(**values)


def _location(outcome: Outcome, named: tuple[Named, ...], found: Findings) -> dict:
    physics = [one for one in named if moves(one.effect)] or list(named)
    place = found.location.place
    if physics and outcome is not Outcome.NOT_IN_CATALOGUE:
        place = BY_NAME[max(physics, key=lambda one: one.lead.ratio).effect].place.value
    return {
        "place": place,
        "evidence": [
            {"variable": one.variable, "finding": one.finding, "share": round(one.share, 4)}
            for one in found.location.evidence
        ],
        "intervals_s": [list(pair) for pair in found.location.intervals_s],
    }


def _missing(one: Named, found: Findings) -> dict:
    """Return one entry; the confidence is that of the lead, shared with its rivals, and less while much is unexplained."""
    effect, best = BY_NAME[one.effect], found.best
    ahead = SUREST if one.lead.likely else min(one.lead.errors, SUREST)
    sure = float(norm.cdf(ahead)) / (1 + len(one.rivals))
    if best.choose > AT_FLOOR and moves(one.effect):
        sure *= explained(found)
    parameters = {
        p.name: {**_interval(best.estimates[f"{one.effect}.{p.name}"]), "unit": p.unit}
        for p in effect.parameters
    }
    return {
        "effect": one.effect,
        "cannot_be_told_from": ties(one, found),
        "confidence": round(sure, 4),
        "parameters": parameters,
        "sentence": _plain(one, best),
    }


def _steady(outcome: Outcome, found: Findings) -> list[dict]:
    return (
        [entry_of(found.steady)]
        if outcome is Outcome.NOT_IN_CATALOGUE and found.steady is not None
        else []
    )


def _interval(one: Estimate) -> dict:
    return {"value": float(one.value), "low": float(one.low), "high": float(one.high)}


def _rig_parameter(free: Free, found: Findings) -> dict:
    after, alone = found.best.estimates[free.name], found.base.estimates[free.name]
    interval = _interval(after)
    return {
        "before": free.get(make_theta(found.case.twin)),
        "parameters_alone": float(alone.value),
        "after": interval["value"],
        "low": interval["low"],
        "high": interval["high"],
        "unit": free.unit,
        "identifiable": bool(after.identifiable),
        "at_bound": bool(after.at_bound),
    }


def _masking(named: tuple[Named, ...], found: Findings) -> list[str]:
    """Return which of the rig's constants had taken on the missing physics while they were fitted alone."""
    sentences = []
    for free in rig_parameters(found.case.twin):
        alone, after = found.base.estimates[free.name], found.best.estimates[free.name]
        hidden = [
            one.effect for one in named if moves(one.effect) and _same_joint(free.name, one.effect)
        ]
        moved = abs(alone.value - after.value) > MASKED * abs(after.value)
        if hidden and moved and not alone.low <= after.value <= alone.high:
            sentences.append(
                f"{free.name} had absorbed the missing {' and '.join(hidden)}: "
                f"{_number(alone.value)} becomes {_number(after.value)}"
            )
    return sentences


def _same_joint(parameter: str, effect: str) -> bool:
    of_pole = BY_NAME[effect].place in (Place.POLE, Place.SENSOR)
    return of_pole if parameter.startswith(("pole", "com")) else not of_pole


def _fit(found: Findings) -> dict:
    parts: dict = {
        part: {
            "before": _finite(found.before[part].score),
            "after": _finite(found.after[part].score),
        }
        for part in ("train", "held_out")
    }
    for joint, (name, scale) in enumerate((("cart_mm", 1e3), ("pole_rad", 1.0))):
        before, after = (
            runs.of_joint(joint, runs.rmse)
            for runs in (found.before["held_out"], found.after["held_out"])
        )
        if before is not None and after is not None:
            parts[f"held_out_{name}"] = {
                "before": _finite(before * scale),
                "after": _finite(after * scale),
            }
    return {**parts, "noise_floor": found.floor.score, "unit": "score"}


def _remainder(found: Findings) -> dict | None:
    ratio = left_over(found)
    if ratio <= AT_FLOOR:
        return None
    evidence = found.remains.evidence
    finding = (
        f"{evidence[0].variable}: {evidence[0].finding}"
        if evidence
        else "depends on no variable that was asked"
    )
    return {"place": found.remains.place, "above_noise_floor": _finite(ratio), "finding": finding}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "beyond measure"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"

"""Known answers: physics is hidden in made recordings, and the diagnosis has to find it.

`list_mistakes` compares a verdict with a case. The suite diagnoses a few cases; all of them are
diagnosed by `python tests/bench/known_answers.py`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.records import Outcome, Recording
from pendulum_sysid.studies.proof.answers import list_inseparable
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.model import Twin
from support.hidden_physics import HIDDEN, INTECO, PERIOD_S, record_hidden

SIZE_ERROR = 0.05  # relative, of an effect's parameter
CONSTANT_ERROR = 0.02  # relative, of the rig's constants where nothing is hidden
SECONDS = 24.0  # of a recording
ORACLE_FACTOR = 1.2  # held-out score / the score of the twin that made the recording

Effects = Mapping[str, Mapping[str, float]]
Fault = Callable[[RawRecording, np.random.Generator], RawRecording]


@dataclass(frozen=True)
class KnownAnswer:
    """Hold one recording and the answer that is right.

    name: of the case.
    effects: hidden effects and their parameters.
    seed: of the motion, the noise and the rig's constants.
    named: effects that the verdict has to name.
    tied: effects that the verdict has to name, or to call inseparable from a name.
    fault: of the recording, beside its physics; None for none.
    finding: the kind of data quality that reports the fault.
    """

    name: str
    effects: Effects
    seed: int
    named: tuple[str, ...] = ()
    tied: tuple[str, ...] = ()
    fault: Fault | None = None
    finding: str = ""


def add_spikes(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    at = random.choice(len(raw.state_stamp_s), 30, replace=False)
    cart, pole = raw.cart.copy(), raw.pole.copy()
    cart[at[:20]] += random.choice([-0.05, 0.05], 20)
    pole[at[10:]] += random.choice([-1.0, 1.0], 20)
    return replace(raw, cart=cart, pole=pole)


def lose_samples(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    kept = random.random(len(raw.state_stamp_s)) > 0.05
    return replace(
        raw, state_stamp_s=raw.state_stamp_s[kept], cart=raw.cart[kept], pole=raw.pole[kept]
    )


def stamp_wrongly(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Move the stamps, not the samples."""
    stamps = raw.state_stamp_s + random.normal(0.0, 0.002, len(raw.state_stamp_s))
    return replace(raw, state_stamp_s=np.sort(stamps))


def sample_unevenly(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    """Take the samples at uneven times and stamp them rightly."""
    times = raw.state_stamp_s
    stamps = np.sort(times + random.normal(0.0, 0.002, len(times)))
    return replace(
        raw,
        state_stamp_s=stamps,
        cart=CubicSpline(times, raw.cart)(stamps),
        pole=CubicSpline(times, raw.pole)(stamps),
    )


def begin_with_another_run(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    n = 130
    t = np.arange(n) * PERIOD_S
    stamps = np.arange(n + len(raw.state_stamp_s)) * PERIOD_S
    return replace(
        raw,
        state_stamp_s=stamps,
        command_stamp_s=stamps,
        cart=np.concatenate([0.1 + 0.05 * np.sin(5 * t), raw.cart]),
        pole=np.concatenate([3.9 + 0.5 * np.cos(7 * t), raw.pole]),
        command=np.concatenate([0.2 * np.sin(6 * t), raw.command]),
    )


def begin_and_stamp_wrongly(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    return stamp_wrongly(begin_with_another_run(raw, random), random)


def wrap_angles(raw: RawRecording, random: np.random.Generator) -> RawRecording:
    return replace(raw, pole=np.mod(raw.pole + np.pi, 2 * np.pi) - np.pi)


DRY, DELAY = {"cart_coulomb_friction": {"level_n": 0.5}}, {"input_delay": {"delay_s": 0.023}}
TRIPLE = {"cart_sign_inverted": {}, **DRY, "pole_quadratic_drag": {"n_m_s2": 2e-5}}


def _hide_alone(effect: str, seed: int = 1) -> KnownAnswer:
    name = effect if seed == 1 else f"{effect}, seed {seed}"
    return KnownAnswer(name, {effect: HIDDEN[effect]}, seed, (effect,))


def _hide_unseparable(effect: str, shown: str, **values: float) -> KnownAnswer:
    return KnownAnswer(effect, {effect: values}, 1, (shown,))


def _hide_nothing(seed: int) -> KnownAnswer:
    return KnownAnswer(f"nothing, seed {seed}", {}, seed)


def _hide_set(effects: Effects, seed: int = 2) -> KnownAnswer:
    return KnownAnswer(" + ".join(effects), effects, seed, tuple(effects))


def _add_fault(fault: Fault, finding: str) -> KnownAnswer:
    effects = {**DRY, **DELAY}
    return KnownAnswer(fault.__name__, effects, 5, tuple(effects), fault=fault, finding=finding)


def _hide_asymmetry() -> KnownAnswer:
    """A cart that never rests shows asymmetric dry friction as friction and a constant force."""
    effects = {**DRY, "cart_friction_asymmetry": {"ratio": 0.3}}
    tied = ("cart_friction_asymmetry",)
    return KnownAnswer("asymmetry", effects, 1, ("cart_coulomb_friction",), tied)


ANSWERS = {
    case.name: case
    for case in (
        *(_hide_alone(effect) for effect in HIDDEN),
        *(
            _hide_alone(effect, 4)
            for effect in (
                "input_delay",
                "cart_coulomb_friction",
                "angle_offset",
                "cart_quadratic_drag",
            )
        ),
        _hide_unseparable("sensor_delay", "input_delay", delay_s=0.02),
        _hide_unseparable("pole_imbalance", "angle_offset", angle_rad=0.03),
        _hide_unseparable("drive_offset", "rail_tilt", offset=0.01),
        _hide_unseparable("sample_period_error", "position_scale", ratio=0.03),
        *(_hide_nothing(seed) for seed in (1, 2, 3)),
        _hide_set({**DRY, "input_delay": {"delay_s": 0.015}}),
        _hide_set(TRIPLE),
        _hide_asymmetry(),
        _add_fault(add_spikes, "spike"),
        _add_fault(lose_samples, "gap"),
        _add_fault(stamp_wrongly, "jitter"),
        _add_fault(sample_unevenly, "jitter"),
        _add_fault(begin_with_another_run, "stale"),
        _add_fault(begin_and_stamp_wrongly, "stale"),
        _add_fault(wrap_angles, "wrap"),
    )
}


def make_recording(case: KnownAnswer) -> tuple[Recording, Twin]:
    """Return the recording of a case, and the twin that made it."""
    recording, truth = record_hidden(dict(case.effects), case.seed, SECONDS)
    if case.fault is None:
        return recording, truth
    signals = recording.signals
    stamps = np.arange(len(signals)) * PERIOD_S
    raw = RawRecording(
        "made", "sha256:5", stamps, signals.cart, signals.pole, stamps, signals.command
    )
    return clean_recording(case.fault(raw, np.random.default_rng(1))), truth


def diagnose_case(name: str) -> Verdict:
    """Return the verdict on a case, diagnosed anew."""
    return diagnose([make_recording(ANSWERS[name])[0]], INTECO, lambda line: None)


diagnose_once = functools.cache(diagnose_case)  # one diagnosis serves every test that looks at it


def list_mistakes(case: KnownAnswer, verdict: Verdict) -> list[str]:
    """Return what a verdict has wrong, in sentences; none when it is right."""
    mistakes = [*_list_wrong_names(case, verdict)]
    if case.finding not in ("", *(finding.kind for finding in verdict.data_quality)):
        mistakes.append(f"no {case.finding} is reported")
    if case.tied:  # another model's sizes promise nothing
        return mistakes
    mistakes += _list_wrong_sizes(case, verdict)
    if not case.effects:
        mistakes += _list_wrong_constants(case, verdict)
    elif not case.fault:
        mistakes += _list_misfits(case, verdict)
    return mistakes


def list_intervals(case: KnownAnswer, verdict: Verdict) -> Iterator[bool]:
    """Yield for every 95 % interval of a verdict whether it holds the truth.

    Another model's intervals promise nothing: a case with ties yields none.
    """
    if case.tied:
        return
    truth = make_recording(case)[1].rig
    for name, constant in verdict.rig_parameters.items():
        yield constant.low <= getattr(truth, name) <= constant.high
    for effect in verdict.missing_physics:
        for name, true in case.effects.get(effect.effect, {}).items():
            yield effect.parameters[name].low <= true <= effect.parameters[name].high


def _list_wrong_names(case: KnownAnswer, verdict: Verdict) -> Iterator[str]:
    ties = {effect.effect: effect.cannot_be_told_from for effect in verdict.missing_physics}
    candidates = {*ties, *(name for inseparable in ties.values() for name in inseparable)}
    outcome = Outcome.NAMED if case.named else Outcome.NOTHING_MISSING
    if verdict.outcome is not outcome and not case.tied:
        yield f"the outcome is {verdict.outcome.value}"
    if not set(case.named) <= set(ties) or (len(ties) > len(case.named) and not case.tied):
        yield f"{', '.join(ties) or 'nothing'} is named"
    for name in case.tied:
        if name not in candidates:
            yield f"{name} is no candidate"
    for name, inseparable_from in ties.items():
        if not set(list_inseparable(name)) <= set(inseparable_from):
            yield f"{name} stands without the effects that no motion can tell from it"


def _list_wrong_sizes(case: KnownAnswer, verdict: Verdict) -> Iterator[str]:
    for effect in verdict.missing_physics:
        for name, true in case.effects.get(effect.effect, {}).items():
            estimate = effect.parameters[name]
            if not abs(estimate.value - true) <= SIZE_ERROR * abs(true):
                yield f"{effect.effect}.{name} is {estimate.value:.4g}, not {true:.4g}"
            if not estimate.low <= estimate.value <= estimate.high:
                yield f"{effect.effect}.{name} lies outside its own interval"


def _list_misfits(case: KnownAnswer, verdict: Verdict) -> Iterator[str]:
    recording, truth = make_recording(case)
    prepared = prepare([recording], INTECO)
    best = run_windows(replace(prepared.case, twin=truth), prepared.split.held_out).score
    assert verdict.fit is not None
    if not verdict.fit.held_out.after < ORACLE_FACTOR * best:
        yield f"the held-out score is {verdict.fit.held_out.after:.3g}; the true twin's {best:.3g}"
    if verdict.remainder is not None:
        yield f"a remainder is left: {verdict.remainder.finding}"


def _list_wrong_constants(case: KnownAnswer, verdict: Verdict) -> Iterator[str]:
    truth = make_recording(case)[1].rig
    if verdict.location is not None or verdict.masking:
        yield "a place or a masking is reported, and nothing is missing"
    for name, constant in verdict.rig_parameters.items():
        true = getattr(truth, name)
        if not abs(constant.after - true) <= CONSTANT_ERROR * abs(true):
            yield f"{name} is {constant.after:.4g}, not {true:.4g}"
        if constant.before != getattr(INTECO.rig, name):
            yield f"{name} did not begin at the nominal twin's value"

"""Gravity belongs to no rig, a pole's frequency to one rig: they convict what ranges cannot."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S, made

from pendulum_sysid import pipeline
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.ask import check_plausibility, list_plausibility_doubts
from pendulum_sysid.plausibility.balances import balance_pole
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Outcome, Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

GRAVITY = "Do lengths and times agree with gravity?"
ONE_RIG = "Are all recordings of one rig?"
FREQUENCY = "Does the hanging pole swing at its own frequency?"


def change_rig(**factors: float) -> Twin:
    """Return INTECO's twin with constants multiplied by factors."""
    changed = {name: factor * getattr(INTECO.rig, name) for name, factor in factors.items()}
    return replace(INTECO, rig=replace(INTECO.rig, **changed))


def scale(recording: Recording, times: float = 1.0, cart: float = 1.0) -> Recording:
    signals = recording.signals
    assert signals.cart is not None
    t = times * np.arange(len(signals)) * signals.period_s
    return Recording.from_arrays(t, signals.command, cart * signals.cart, signals.pole)


def check(recordings: list[Recording], twin: Twin = INTECO) -> dict[str, Check]:
    return {c.question: c for c in check_plausibility(prepare_case(recordings, twin))}


@pytest.mark.parametrize("noise", [0.0, 1.0, 20.0])
@pytest.mark.parametrize(
    "twin", [INTECO, change_rig(pole_inertia_kg_m2=3.0, com_distance_m=2.0)], ids=["inteco", "big"]
)
def test_the_motion_of_any_rig_shows_gravity(twin: Twin, noise: float) -> None:
    """Twenty times the noise hides half of the coupling: the bounds still hold gravity."""
    recording = made(twin, noise=noise)
    case = prepare_case([recording], twin)
    least, most = balance_pole(case.signals, case.state).gravity_m_s2
    assert least / 1.05 < 9.81 < most * 1.05
    if noise <= 1.0:
        assert (least, most) == pytest.approx((9.81, 9.81), rel=0.05)


@pytest.mark.parametrize(
    "times, cart, answer",
    [
        (2.0, 1.0, CheckAnswer.NO),
        (0.5, 1.0, CheckAnswer.NO),
        (1.0, 0.2, CheckAnswer.NO),
        (1.4, 1.0, CheckAnswer.DOUBT),
        (1.1, 1.0, CheckAnswer.YES),
        (1.0, 1.3, CheckAnswer.YES),
    ],
)
def test_lengths_or_times_in_another_unit_show_another_gravity(
    times: float, cart: float, answer: CheckAnswer
) -> None:
    """Half seconds keep within every range, and end as a torque on the pole that is gravity's."""
    found = check([scale(made(INTECO), times, cart)])[GRAVITY]
    assert found.answer is answer
    shown = 9.81 * cart / times**2
    assert float(found.observed.split()[0]) == pytest.approx(shown, rel=0.05)


def test_a_twin_of_the_moon_is_refused_with_the_gravity_that_shows() -> None:
    moon = change_rig(gravity_m_s2=0.165)
    verdict = pipeline.diagnose([made(INTECO)], moon, lambda line: None)
    assert verdict.outcome is Outcome.UNUSABLE
    assert "expected gravity of 1.62 m/s^2, found 10.1 m/s^2" in verdict.sentence
    assert "gravity_m_s2 of the twin file" in verdict.sentence


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_an_encoder_that_counts_one_way_is_refused(direction: float) -> None:
    signals = made(INTECO).signals
    assert signals.cart is not None
    way = 5.0 * direction * np.abs(np.diff(signals.cart, prepend=0.0)).cumsum()
    t = np.arange(len(signals)) * PERIOD_S
    recording = Recording.from_arrays(t, signals.command, way, signals.pole)
    found = check([recording])["Is the cart's position in metres?"]
    assert found.answer is CheckAnswer.NO
    assert "counts without a direction" in found.advice


def count_one_way(angle: Floats) -> Floats:
    return math.pi + np.maximum(np.diff(angle, prepend=angle[0]), 0.0).cumsum()


@pytest.mark.parametrize(
    "spoil", [count_one_way, lambda angle: 0.1 * np.rint(angle * 4096 / math.tau)]
)
def test_an_angle_that_moves_as_no_pole_does_is_refused(
    spoil: Callable[[Floats], Floats],
) -> None:
    """A search took six minutes to say that the recording does not look like the rig."""
    signals = made(INTECO, amplitude=0.3).signals
    assert signals.pole is not None
    t = np.arange(len(signals)) * PERIOD_S
    recording = Recording.from_arrays(t, signals.command, signals.cart, spoil(signals.pole))
    found = check([recording])["Is it an angle in radians?"]
    assert found.answer is CheckAnswer.NO
    assert "whether its encoder counts both ways" in found.advice


def test_recordings_of_two_rigs_are_not_searched_as_one() -> None:
    other = change_rig(pole_inertia_kg_m2=2.0)
    recordings = [made(INTECO), made(other, seed=1)]
    with pytest.raises(UnusableRecording, match="recordings of one rig"):
        list_plausibility_doubts(prepare_case(recordings, INTECO))
    found = check(recordings)[ONE_RIG]
    assert found.observed.endswith("Hz from 0 s on")
    assert "Hz from 20 s on" in found.observed


def test_two_recordings_of_one_rig_are_of_one_rig() -> None:
    loaded = change_rig(cart_viscous_n_s_m=3.0, force_per_pwm_n=0.7)
    alike = check([made(INTECO), made(loaded, seed=1)])[ONE_RIG]
    assert alike.answer is CheckAnswer.YES
    assert ONE_RIG not in check([made(INTECO)])


def test_the_twin_of_another_pole_is_doubted_beside_the_answer() -> None:
    """Other constants explain the motion of another rig as a whole: forces scale with the mass."""
    long = change_rig(com_distance_m=2.4, pole_inertia_kg_m2=6.0)
    recording = made(long)
    (doubt,) = list_plausibility_doubts(prepare_case([recording], INTECO))
    assert doubt.startswith(FREQUENCY)
    assert "check that this is the twin of this rig" in doubt
    verdict = pipeline.diagnose([recording], INTECO, lambda line: None)
    assert verdict.outcome is Outcome.NOTHING_MISSING
    assert verdict.warnings[0] == doubt


def test_sine_and_cosine_that_were_exchanged_are_doubted() -> None:
    """They turn the angle by a quarter and mirror it; a search finds an offset and a sign."""
    signals = made(INTECO).signals
    assert signals.pole is not None
    exchanged = np.unwrap(np.arctan2(np.cos(signals.pole), np.sin(signals.pole)))
    t = np.arange(len(signals)) * PERIOD_S
    recording = Recording.from_arrays(t, signals.command, signals.cart, exchanged)
    (doubt,) = list_plausibility_doubts(prepare_case([recording], INTECO))
    assert "a pole that hangs at 4.71 rad" in doubt
    assert "--sin and --cos" in doubt

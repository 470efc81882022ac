"""Each kind of phase: within the limit, of the right length, repeatable, and on the rail."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pendulum_bridge.emulator.conceal import draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.session import play_plan
from pendulum_twin.errors import BadInputError
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import (
    Chirp,
    FreeDecay,
    Multisine,
    Phase,
    Push,
    Rest,
    Samples,
    Steps,
)
from pendulum_twin.plans.waveforms import Envelope, limit_amplitude, make_envelope
from pendulum_twin.rig import Rig

ROOM = Envelope()
HZ = st.floats(0.02, 9.0)
ROOMS = st.builds(
    Envelope,
    limit=st.floats(0.05, 2.0),
    acceleration_m_s2=st.floats(1.0, 100.0),
    swing_hz=st.floats(0.3, 5.0),
    half_length_m=st.floats(0.1, 3.0),
)


def waving(
    kind: str, seconds: float, amplitude: float, hz: tuple[float, float], seed: int
) -> Phase:
    """Return a phase of a kind."""
    if kind == "chirp":
        return Chirp(seconds=seconds, from_hz=hz[0], to_hz=hz[1], amplitude=amplitude)
    if kind == "multisine":
        return Multisine(seconds=seconds, tones_hz=hz, amplitude=amplitude, seed=seed)
    if kind == "steps":
        return Steps(seconds=seconds, amplitude=amplitude, seed=seed)
    return FreeDecay(seconds=seconds + 5, amplitude=amplitude, swings=1)


@settings(deadline=None, max_examples=150)
@given(
    kind=st.sampled_from(["chirp", "multisine", "steps", "free_decay"]),
    seconds=st.floats(0.1, 20),
    share=st.floats(0.05, 1),
    hz=st.tuples(HZ, HZ),
    seed=st.integers(0, 1000),
    rate_hz=st.floats(20, 300),
    room=ROOMS,
)
def test_commands_stay_within_the_amplitude_and_last_as_long_as_asked(
    kind, seconds, share, hz, seed, rate_hz, room
) -> None:
    amplitude = max(0.001, share * room.limit)
    phase = waving(kind, seconds, amplitude, hz, seed)
    pieces = phase.make_stretches(room, rate_hz)
    commands = np.concatenate([piece.commands for piece in pieces])
    assert np.all(np.isfinite(commands))
    assert np.max(np.abs(commands)) <= amplitude * (1 + 1e-12)
    assert abs(len(commands) - phase.seconds * rate_hz) <= 2
    again = np.concatenate([part.commands for part in phase.make_stretches(room, rate_hz)])
    assert np.array_equal(commands, again)


@pytest.mark.parametrize(
    "phase", [Multisine(seconds=5, amplitude=0.2), Steps(seconds=5, amplitude=0.2)]
)
def test_another_seed_is_another_plan(phase: Phase) -> None:
    first, other = (
        replace(phase, seed=seed).make_stretches(ROOM, 100.0)[0].commands for seed in (0, 1)
    )
    assert not np.array_equal(first, other)


def test_a_chirp_passes_its_frequencies_in_order() -> None:
    commands = (
        Chirp(seconds=20, from_hz=0.5, to_hz=8, amplitude=0.1)
        .make_stretches(ROOM, 100.0)[0]
        .commands
    )
    turns = np.flatnonzero(np.diff(np.sign(commands))) / 100  # two a period
    hz = 1 / (turns[2:] - turns[:-2])
    assert hz[0] == pytest.approx(0.6, rel=0.1) and hz[-1] == pytest.approx(7.7, rel=0.1)
    assert hz[len(hz) // 2] == pytest.approx(4.2, rel=0.1)  # as many turns before as after it


def test_tones_are_where_they_were_asked_to_be() -> None:
    commands = (
        Multisine(seconds=20, tones_hz=(1.0, 2.5), amplitude=0.2)
        .make_stretches(ROOM, 100.0)[0]
        .commands
    )
    strength = np.abs(np.fft.rfft(commands))
    assert set(np.argsort(strength)[-2:] / 20) == {1.0, 2.5}
    assert np.max(np.abs(commands)) == pytest.approx(0.2, rel=1e-3)


def test_low_tones_are_weaker_where_the_rail_is_too_short() -> None:
    assert (
        np.max(
            np.abs(
                Chirp(seconds=9, from_hz=0.2, to_hz=0.2, amplitude=0.5)
                .make_stretches(ROOM, 100.0)[0]
                .commands
            )
        )
        < 0.03
    )
    assert (
        np.max(
            np.abs(
                Multisine(seconds=9, tones_hz=(0.2,), amplitude=0.5)
                .make_stretches(ROOM, 100.0)[0]
                .commands
            )
        )
        < 0.03
    )
    assert limit_amplitude(ROOM, 0.2) < 0.03


def test_a_free_decay_is_a_kick_and_then_nothing() -> None:
    kick, decay = FreeDecay(seconds=10, amplitude=0.2, swings=3).make_stretches(ROOM, 100.0)
    assert len(kick.commands) == round(3 / ROOM.swing_hz * 100) and np.max(
        kick.commands
    ) == pytest.approx(0.2)
    assert np.all(decay.commands == 0) and len(decay.commands) + len(kick.commands) == 1000
    assert not kick.centred and not decay.centred


def test_samples_are_sent_as_they_stand() -> None:
    plan = make_excitation(Plan((Samples(commands=(0.5, -0.5, 0.123), centred=False),)), ROOM)
    assert plan.commands.tolist() == [0.5, -0.5, 0.123] and plan.push_ends is None
    assert (
        plan.stretches == (("samples", 3),)
        and plan.get_stretch(2) == "samples"
        and plan.get_stretch(3) == ""
    )


def test_a_rig_without_a_rail_is_refused(nominal: Rig) -> None:
    with pytest.raises(BadInputError, match="rail_half_length_m, found one missing"):
        make_envelope(replace(nominal, rail_half_length_m=None))
    room = make_envelope(nominal)
    assert (room.limit, room.half_length_m) == (0.5, 0.9)
    assert (room.acceleration_m_s2, room.swing_hz) == pytest.approx((18.6, 1.07), rel=0.01)


def with_rests(nominal: Rig, *phases: Phase) -> Excitation:
    return make_excitation(
        Plan((Push(), *phases, Rest(seconds=2, centred=True))), make_envelope(nominal)
    )


DRIVEN = {
    "chirp": Chirp(seconds=12, from_hz=0.3, to_hz=3, amplitude=0.5),
    "low chirp": Chirp(seconds=12, from_hz=0.5, to_hz=0.1, amplitude=0.5),
    "multisine": Multisine(seconds=12, amplitude=0.5),
    "low multisine": Multisine(seconds=12, amplitude=0.5, tones_hz=(0.15, 0.4, 0.9), seed=1),
    "steps": Steps(seconds=12, amplitude=0.5, hold_s=3.0),
    "free decay": FreeDecay(seconds=12, amplitude=0.5, swings=4),
}


@pytest.mark.parametrize(
    "seed", [641, 16, 18]
)  # dead zone and tilt; lag and a wrong sign; dry friction and a wrong sign
@pytest.mark.parametrize("name", DRIVEN)
def test_the_cart_stays_on_the_rail(name: str, seed: int, nominal: Rig) -> None:
    kept = play_plan(
        EmulatedRig(draw_concealed(seed, 2, nominal), timestep_s=1e-3),
        with_rests(nominal, DRIVEN[name]),
    )
    assert 0.05 < np.max(np.abs(kept.positions[:, 0])) < 0.75 * nominal.rail_half_length_m
    assert np.max(np.abs(kept.commands)) <= 0.5


@pytest.mark.parametrize("effect", ["input_sign_inverted", "cart_sign_inverted"])
def test_a_rig_with_a_wrong_sign_is_centred_too(effect: str, nominal: Rig) -> None:
    """At half the rail, more than the free part, when the rest begins."""
    pushed = Samples(commands=(*[0.35] * 40, *[-0.35] * 33), centred=False)
    plan = with_rests(nominal, pushed, Rest(seconds=5, centred=True))
    kept = play_plan(EmulatedRig(Concealed({effect: {}}, nominal), timestep_s=1e-3), plan)
    cart = np.abs(kept.positions[:, 0])
    assert np.max(cart) > 0.4 and cart[-1] < 0.5 * np.max(cart)


def test_a_rest_that_is_centred_brings_the_cart_back(nominal: Rig) -> None:
    away = Samples(commands=(*[0.3] * 30, *[-0.3] * 28), centred=False)
    ends = []
    for centred in (True, False):
        plan = with_rests(nominal, away, Rest(seconds=3, centred=centred))
        ends.append(
            abs(
                play_plan(EmulatedRig(Concealed({}, nominal), timestep_s=1e-3), plan).positions[
                    -250, 0
                ]
            )
        )
    assert ends[0] < 0.4 * ends[1]

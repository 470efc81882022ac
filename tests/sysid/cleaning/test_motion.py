"""Recordings that cannot answer: each ends as unusable, with what to do."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO, make_command, record_hidden

from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.records import Recording
from pendulum_twin.signals import Signals

N = 2000
EVERY = np.ones(N, dtype=bool)
STILL = np.zeros(N)
NOISE = np.random.default_rng(0).normal(0.0, 1.0, (2, N))


def diagnosed(cart: np.ndarray, pole: np.ndarray, command: np.ndarray) -> dict:
    recording = Recording("made", "sha256:0", Signals(0.01, command, cart, pole, EVERY, EVERY))
    return diagnose([recording], INTECO, lambda line: None).to_dict()


@pytest.mark.parametrize(
    ("cart", "pole", "command", "why"),
    [
        (STILL, STILL + np.pi, STILL, "record while the rig moves"),
        (1e-5 * NOISE[0], np.pi + 1e-4 * NOISE[1], STILL, "record while the rig moves"),
        (STILL, STILL + np.pi, make_command(0, N), "expected the cart to answer the command"),
        (
            np.cumsum(1e-3 * NOISE[0]),
            np.pi + 0.1 * NOISE[1],
            make_command(0, N),
            "moving no more by it than without",
        ),
    ],
    ids=["still", "noise", "standing", "chance"],
)
def test_a_recording_that_cannot_answer_is_unusable(cart, pole, command, why: str) -> None:
    found = diagnosed(cart, pole, command)
    assert found["outcome"] == "unusable" and why in found["sentence"]
    assert found["location"] is None and found["missing_physics"] == [] and found["fit"] is None


def test_a_recording_of_another_rig_run_does_not_follow_its_command() -> None:
    recording, _ = record_hidden({}, seed=1)
    other = make_command(99, len(recording.signals))
    swapped = replace(recording, signals=replace(recording.signals, command=other))
    assert diagnose([swapped], INTECO, lambda line: None).to_dict()["outcome"] in {
        "unusable",
        "not_in_catalogue",
    }


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_pole_whose_encoder_stands_still_is_said_to(noise: float) -> None:
    """It was said that the cart does not follow its command: the pole's reaction was missing."""
    recording, _ = record_hidden({}, seed=1)
    stuck = np.full(len(recording.signals), 3.1) + noise * np.resize(
        NOISE[1], len(recording.signals)
    )
    recording = replace(recording, signals=replace(recording.signals, pole=stuck))
    found = diagnose([recording], INTECO, lambda line: None).to_dict()
    assert found["outcome"] == "unusable"
    assert "check the pole's encoder, or leave out the pole" in found["sentence"]


def test_a_cart_that_was_not_told_to_move_leaves_the_pole() -> None:
    t = np.arange(N) * 0.01
    swing = np.pi + 0.3 * np.exp(-0.05 * t) * np.cos(6.0 * t) + 1e-4 * NOISE[1]
    found = diagnosed(STILL, swing, STILL)
    assert found["outcome"] != "unusable"
    assert set(found["rig_parameters"]) == {"com_distance_m", "pole_viscous_n_m_s"}

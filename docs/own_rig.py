"""Log a rig of our own making, as a laboratory would: the recordings of docs/tutorial.md.

No code of the twin: cart and pole by the equations of motion, a friction that follows tanh, a slow
motor, encoders, a clock that jitters. It takes some seconds:
    python docs/own_rig.py monday.csv --seed 1
    python docs/own_rig.py tuesday.csv --seed 2
"""

import argparse
import math
from pathlib import Path

import numpy as np

MASS_KG, POLE_KG, POLE_M, INERTIA_KG_M2, GRAVITY_M_S2 = 1.45, 0.21, 0.24, 0.016128, 9.81
FORCE_N_V, CART_N_S_M, POLE_N_M_S = 1.9, 2.2, 0.0011
DRY_N, MOTOR_S = 1.3, 0.045  # what the tutorial's twin file leaves out
CREEP_M_S = 2e-3  # speed at which most of the dry friction is there
STEP_S, SECONDS, STEPS_A_SAMPLE = 0.0005, 70.0, 10
LARGEST_V, CENTRE_V_M, BRAKE_V_S_M = 10.0, 9.0, 3.0  # the controller keeps the cart in the middle
CART_CM, POLE_DEG, VOLT, CLOCK_S = 0.01, 0.09, 0.01, 1e-4  # what the log resolves; the jitter
TURN_S, REST_S, TONES = 14.0, 3.0, 8  # each turn begins with a rest

State = tuple[float, float, float, float]  # cart m, m/s; pole rad (0 upright), rad/s


def differentiate(state: State, force_n: float) -> State:
    """Return the rates of the state under the motor's force."""
    _, speed, angle, rate = state
    sine, cosine = math.sin(angle), math.cos(angle)
    friction = -CART_N_S_M * speed - DRY_N * math.tanh(speed / CREEP_M_S)
    coupling = -POLE_KG * POLE_M * cosine
    cart = force_n + friction - POLE_KG * POLE_M * rate * rate * sine
    pole = POLE_KG * GRAVITY_M_S2 * POLE_M * sine - POLE_N_M_S * rate
    determinant = MASS_KG * INERTIA_KG_M2 - coupling * coupling
    return (
        speed,
        (INERTIA_KG_M2 * cart - coupling * pole) / determinant,
        rate,
        (MASS_KG * pole - coupling * cart) / determinant,
    )


def move(state: State, rates: State, step_s: float) -> State:
    """Return the state after a step along its rates."""
    x, v, th, w = (a + step_s * b for a, b in zip(state, rates, strict=True))
    return x, v, th, w


def advance(state: State, force_n: float) -> State:
    """Return the state after a step of the classical Runge-Kutta method."""
    first = differentiate(state, force_n)
    second = differentiate(move(state, first, STEP_S / 2), force_n)
    third = differentiate(move(state, second, STEP_S / 2), force_n)
    fourth = differentiate(move(state, third, STEP_S), force_n)
    for rates, share in ((first, 1), (second, 2), (third, 2), (fourth, 1)):
        state = move(state, rates, share * STEP_S / 6)
    return state


def log_rig(seed: int) -> list[tuple[float, float, float, float]]:
    """Return a log: time s, motor V, cart cm, pole degrees (0 hanging, clockwise)."""
    chance = np.random.default_rng(seed)
    hertz = chance.uniform(0.3, 3.0, TONES)
    volts = chance.uniform(0.5, 1.6, TONES)
    phases = chance.uniform(0.0, 2 * math.pi, TONES)
    state, force_n, volt, rows = (0.0, 0.0, math.pi, 0.0), 0.0, 0.0, []
    for k in range(round(SECONDS / STEP_S)):
        time_s = k * STEP_S
        if k % STEPS_A_SAMPLE == 0:
            volt = 0.0
            if time_s % TURN_S > REST_S:
                tones = float(np.sum(volts * np.sin(2 * math.pi * hertz * time_s + phases)))
                asked = tones - CENTRE_V_M * state[0] - BRAKE_V_S_M * state[1]
                volt = round(min(max(asked, -LARGEST_V), LARGEST_V) / VOLT) * VOLT
            stamp = time_s + chance.normal(0.0, CLOCK_S)
            degrees = round(-math.degrees(state[2] - math.pi) / POLE_DEG) * POLE_DEG
            rows.append((stamp, volt, round(100 * state[0] / CART_CM) * CART_CM, degrees))
        force_n += STEP_S * (FORCE_N_V * volt - force_n) / MOTOR_S
        state = advance(state, force_n)
    return rows


def main() -> None:
    """Write the log that was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, metavar="OUT.csv")
    parser.add_argument("--seed", type=int, required=True, help="of the tones that are played")
    arguments = parser.parse_args()
    lines = ["time_s,motor_v,cart_cm,pole_deg"]
    lines += [",".join(f"{value:.4f}" for value in row) for row in log_rig(arguments.seed)]
    arguments.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

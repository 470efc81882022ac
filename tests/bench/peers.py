"""The twin's peers: other engines on the same cart and pole, or on the nearest model."""

import gymnasium
import mujoco
import numpy as np
from mujoco import rollout
from scipy.integrate import solve_ivp

from pendulum_twin.rig import Rig

SUBSTEPS = 30


def make_gymnasium_steps(pendulums: int, steps: int):
    """Return a function that steps Gymnasium's CartPole-v1, all pendulums in a numpy vector."""
    env = gymnasium.make_vec(
        "CartPole-v1", num_envs=pendulums, vectorization_mode="vector_entry_point"
    )
    env.reset(seed=1)
    actions = np.random.default_rng(1).integers(0, 2, (steps, pendulums))

    def run():
        for action in actions:
            env.step(action)

    return run


def make_mujoco_model(rig: Rig) -> mujoco.MjModel:
    """Return the rig in MuJoCo; its hinge turns about -y, for the twin's sign of the angle."""
    distance = rig.total_mass_kg * rig.com_distance_m / rig.pole_mass_kg
    inertia = rig.pole_inertia_kg_m2 - rig.pole_mass_kg * distance**2
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="0.001" integrator="RK4" gravity="0 0 -{rig.gravity_m_s2}"/>
          <worldbody>
            <body>
              <joint name="cart" type="slide" axis="1 0 0" damping="{rig.cart_viscous_n_s_m}"/>
              <inertial pos="0 0 0" mass="{rig.cart_mass_kg}" diaginertia="1 1 1"/>
              <body>
                <joint type="hinge" axis="0 -1 0" damping="{rig.pole_viscous_n_m_s}"/>
                <inertial pos="0 0 {distance}" mass="{rig.pole_mass_kg}"
                  diaginertia="{inertia} {inertia} {inertia}"/>
              </body>
            </body>
          </worldbody>
          <actuator><motor joint="cart" gear="{rig.force_per_pwm_n}"/></actuator>
        </mujoco>""")


def make_mujoco_steps(rig: Rig, starts: np.ndarray, command: np.ndarray):
    """Return a function that runs MuJoCo and returns states (pendulums, samples, 4).

    starts: (pendulums, 4) start states.

    command: (samples,), each held for 30 steps of 1 ms of Runge-Kutta of fourth order, as in the
    twin.
    """
    model = make_mujoco_model(rig)
    data = mujoco.MjData(model)
    first = np.concatenate(
        [np.zeros((len(starts), 1)), starts], axis=1
    )  # time, positions, velocities
    controls = np.tile(np.repeat(command, SUBSTEPS)[:, None], (len(starts), 1, 1))

    def run():
        states, _ = rollout.rollout(model, data, first, controls)
        return states[:, SUBSTEPS - 1 :: SUBSTEPS, 1:]

    return run


def make_scipy_run(rig: Rig, start: np.ndarray, command: np.ndarray, period_s: float):
    """Return a function that runs the rig with SciPy's `solve_ivp`.

    RK45; no step goes over a sample of the command.
    """
    m, J, g = rig.total_mass_kg, rig.pole_inertia_kg_m2, rig.gravity_m_s2
    S, p1, fc, fp = (
        m * rig.com_distance_m,
        rig.force_per_pwm_n,
        rig.cart_viscous_n_s_m,
        rig.pole_viscous_n_m_s,
    )
    last = len(command) - 1

    def rates(t, state):
        _, th, v, w = state
        sine, cosine = np.sin(th), np.cos(th)
        force = p1 * command[min(int(t / period_s), last)] - fc * v - S * w * w * sine
        torque = S * g * sine - fp * w
        determinant = m * J - (S * cosine) ** 2
        return (
            v,
            w,
            (J * force + S * cosine * torque) / determinant,
            (m * torque + S * cosine * force) / determinant,
        )

    times = period_s * np.arange(len(command))

    def run():
        return solve_ivp(
            rates, (0.0, times[-1]), start, t_eval=times, rtol=1e-6, atol=1e-8, max_step=period_s
        ).y.T

    return run

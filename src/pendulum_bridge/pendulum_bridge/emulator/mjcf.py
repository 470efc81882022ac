"""A rig as a MuJoCo model: a cart on a slide and a pole on a hinge.

Constant dry friction, drag and springs are the engine's own.

The base model holds only the moved mass m, the first moment S = m l and the pole's inertia Jp
about its axis. A pole of mass mp with its centre at S/mp and the inertia Jp - S^2/mp about it, on
a cart of m - mp, has exactly these.

Dry friction is the engine's `frictionloss`, a soft constraint, at its stiffest: time constant of
two steps, impedance 0.9999. Measured on a 0.7 kg block with 1 N of friction, RK4, steps of 0.25
ms, against closed forms and a rigid stick-slip in steps of 10 us: pushed with 90 % of its friction
it creeps at 3e-8 m/s, comes to rest within 5e-8 m, and stays within 1e-7 m for 10 s under a sine.
(With the pole on it, reversals cost 1e-4 m a second; `engine.py` cuts these steps finer, so that
less than the encoder's step remains.) The engine's defaults creep at 1e-3 m/s, and `implicitfast`
stops 1e-4 m short.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import mujoco

from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

TIMESTEP_S = 2.5e-4
LEAST_MOTOR_SHARE = 1e-3  # of the moved mass: a motor without mass has no motion of its own
POLE_MASS_MARGIN = 1.25  # times the mass of the lightest pole body with the rig's S and Jp

TEMPLATE = """
<mujoco model="cart and pole">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{timestep}" integrator="RK4" gravity="0 0 {gravity}"
          iterations="20" tolerance="1e-10">
    <flag contact="disable"/>
  </option>
  <default>
    <joint solreffriction="{stiffness} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
  </default>
  <worldbody>
    <body name="cart">
      <joint name="cart" type="slide" axis="1 0 0" range="{left} {right}" {cart_joint}/>
      <inertial pos="0 0 0" mass="{cart_mass}" diaginertia="1e-3 1e-3 1e-3"/>
      <body name="pole">
        <joint name="pole" type="hinge" axis="0 -1 0" {pole_joint}/>
        <inertial pos="{aside} 0 {centre}" mass="{pole_mass}"
                  diaginertia="{inertia} {inertia} {inertia}"/>
      </body>
    </body>{motor}
  </worldbody>{belt}
</mujoco>
"""
# The motor's own mass as it is seen at the belt, and the belt between the motor and the cart.
MOTOR = """
    <body name="motor">
      <joint name="motor" type="slide" axis="1 0 0"/>
      <inertial pos="0 0 0" mass="{mass}" diaginertia="1e-3 1e-3 1e-3"/>
    </body>"""
BELT = """
  <tendon>
    <fixed name="belt" stiffness="{stiffness}" damping="{damping}" springlength="0">
      <joint joint="motor" coef="1"/>
      <joint joint="cart" coef="-1"/>
    </fixed>
  </tendon>"""

Effects = Mapping[str, Mapping[str, float]]


def build_model(rig: Rig, effects: Effects, timestep_s: float = TIMESTEP_S) -> mujoco.MjModel:
    """Return the compiled model of a rig with cart and pole.

    Joint 0 is the cart (m, positive along the rail), joint 1 the pole (rad, 0 upright,
    counterclockwise positive when the rail points right and the view is along +y). The cart stops
    at the ends of the rail. Where the belt stretches, joint 2 is the motor (m along the belt), on
    which the drive's force acts.
    effects: the model has those that MuJoCo has itself; `engine` sets friction that changes.
    timestep_s: step for which the stiffness of dry friction is chosen.
    Raises BadInputError when cart or pole is missing, or when no bodies have the rig's constants.
    """
    return mujoco.MjModel.from_xml_string(write_mjcf(rig, effects, timestep_s))


def write_mjcf(rig: Rig, effects: Effects, timestep_s: float = TIMESTEP_S) -> str:
    """Return the model's XML; see `build_model`."""
    pole_mass, distance, inertia = compute_pole_body(rig)
    ahead = effects.get("pole_imbalance", {}).get("angle_rad", 0.0)
    end = rig.rail_half_length_m or 1e3
    motor_kg, motor, belt = _describe_belt(rig, effects)
    return TEMPLATE.format(
        timestep=repr(timestep_s),
        stiffness=repr(2 * timestep_s),
        gravity=repr(-rig.gravity_m_s2),
        left=repr(-end),
        right=repr(end),
        cart_mass=repr(rig.total_mass_kg - pole_mass - motor_kg),
        pole_mass=repr(pole_mass),
        aside=repr(-distance * math.sin(ahead)),
        centre=repr(distance * math.cos(ahead)),
        inertia=repr(inertia),
        cart_joint=_describe_cart_joint(rig, effects),
        pole_joint=_describe_pole_joint(rig, effects),
        motor=motor,
        belt=belt,
    )


def compute_pole_body(rig: Rig) -> tuple[float, float, float]:
    """Return the pole body's mass (kg), centre from the axis (m) and own inertia (kg m^2).

    The mass is the rig's pole mass where that leaves a positive inertia about the centre. Else the
    pole body is heavier and the cart lighter: motion shows only m, S and Jp.
    """
    if rig.com_distance_m is None or rig.pole_inertia_kg_m2 is None or not rig.has_cart:
        raise BadInputError("expected a rig with cart and pole to emulate, found only one of them")
    moment = rig.total_mass_kg * rig.com_distance_m
    mass = rig.pole_mass_kg or 0.0
    if moment**2 / mass >= rig.pole_inertia_kg_m2:
        mass = POLE_MASS_MARGIN * moment**2 / rig.pole_inertia_kg_m2
    if mass >= rig.total_mass_kg:
        least = POLE_MASS_MARGIN * moment**2 / rig.total_mass_kg
        raise BadInputError(
            f"pole_inertia_kg_m2: expected above {least:.3g} for this mass and com_distance_m, "
            f"found {rig.pole_inertia_kg_m2:g}: no bodies move like that"
        )
    return mass, moment / mass, rig.pole_inertia_kg_m2 - moment**2 / mass


def _describe_belt(rig: Rig, effects: Effects) -> tuple[float, str, str]:
    """Return the motor's mass (kg) and the XML of motor and belt; no mass for a stiff belt.

    The two masses swing against each other with the belt's period, whatever the pole does.
    """
    sizes = effects.get("stretching_belt", {"period_s": 0.0})
    if not sizes["period_s"]:
        return 0.0, "", ""
    share, circular = max(sizes["motor_share"], LEAST_MOTOR_SHARE), math.tau / sizes["period_s"]
    motor_kg = share * rig.total_mass_kg
    reduced_kg = motor_kg * (1.0 - share)
    return (
        motor_kg,
        MOTOR.format(mass=repr(motor_kg)),
        BELT.format(
            stiffness=repr(reduced_kg * circular**2),
            damping=repr(2.0 * sizes["damping"] * circular * reduced_kg),
        ),
    )


def _describe_cart_joint(rig: Rig, effects: Effects) -> str:
    drag = effects.get("cart_quadratic_drag", {}).get("n_s2_m2", 0.0)
    level = effects.get("cart_coulomb_friction", {}).get("level_n", 0.0)
    spring = effects.get("rail_spring", {"n_per_m": 0.0, "centre_m": 0.0})
    return _describe_joint(
        rig.cart_viscous_n_s_m, drag, level, spring["n_per_m"], spring["centre_m"]
    )


def _describe_pole_joint(rig: Rig, effects: Effects) -> str:
    drag = effects.get("pole_quadratic_drag", {}).get("n_m_s2", 0.0)
    level = effects.get("pole_coulomb_friction", {}).get("level_n_m", 0.0)
    twist = effects.get("pole_spring", {}).get("n_m_per_rad", 0.0)
    return _describe_joint(rig.pole_viscous_n_m_s, drag, level, twist, math.pi)


def _describe_joint(
    viscous: float | None, drag: float, level: float, stiffness: float, origin: float
) -> str:
    """Return the XML attributes of a joint.

    Its force is -(viscous + drag |v|) v - stiffness (q - origin), and dry friction of `level`.
    """
    return (
        f'damping="{viscous or 0.0!r} {drag!r}" frictionloss="{level!r}" '
        f'stiffness="{stiffness!r}" springref="{origin!r}"'
    )

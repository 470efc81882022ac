"""Describe a twin's rig as a URDF, for robot_state_publisher, RViz and any engine that reads one.

Frames: x along the rail, z up. The joint `cart` slides along +x, 0 in the middle of the rail. The
joint `pole` turns about -y, 0 upright: counterclockwise positive as seen along +y, with the
positive end of the rail on the right. So `joint_states` of twin and rig drive the model as they
are.

Motion depends only on the moved mass m, the first moment S = m l and the pole's inertia Jp about
its axis. They are those of a pole of mass mp on a cart of m - mp, whose centre of mass lies S/mp
from the axis and whose inertia about it is, by Steiner, Jp - S^2/mp. The bodies are drawn plainly:
a rod as long as its centre of mass demands; the other sizes are chosen to be seen.
"""

from __future__ import annotations

import math
import os
import sys
import xml.etree.ElementTree as ET

from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parser import Parser, add_common_options, complete
from pendulum_twin.rig import Rig
from pendulum_twin.topics import CART, POLE

# m, N and m/s: stands for a limit that the twin file does not give; URDF demands a number.
UNLIMITED = 1000.0
HEAVIER = 1.25  # times the lightest pole that can have the rig's S and Jp
SLENDER = 0.01  # the pole's inertia about its own length, of that across; it never turns about it

CART_SIZE = (0.16, 0.08, 0.06)  # m
ROD_RADIUS, SHORTEST_ROD = 0.008, 0.05  # m
RAIL_SIZE, RAIL_IF_UNKNOWN = (0.02, 0.02), 1.0  # m: its height and depth; half its length
GREY, BLUE, ORANGE = "0.6 0.6 0.6 1", "0.2 0.4 0.7 1", "0.9 0.5 0.1 1"


def make_urdf(twin: Twin) -> str:
    """Return the twin's rig as URDF text with the joints `cart` (m) and `pole` (rad) that it has.

    A limit that is not in the twin file is UNLIMITED. Raises BadInputError when no bodies have the
    rig's constants.
    """
    rig = twin.rig
    robot = ET.Element("robot", name=twin.name)
    # the pole turns on the cart or, without a cart, on what stands still
    carrier = _add_link(robot, "rail_link")
    if rig.has_cart:
        _add_visual(carrier, _make_rail(rig), "0 0 0", "rail", GREY)
        carrier = _add_cart(robot, rig, _get_friction(twin, "cart_coulomb_friction", "level_n"))
    _add_visual(
        carrier, ET.Element("box", size=_format_numbers(*CART_SIZE)), "0 0 0", "cart", BLUE
    )
    if rig.has_pole:
        _add_pole(robot, rig, carrier, _get_friction(twin, "pole_coulomb_friction", "level_n_m"))
    ET.indent(robot)
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def _compute_pole_mass(rig: Rig) -> float:
    """Return the mass of the pole's body, kg; 0 without a pole.

    It is the rig's pole mass where that leaves a positive inertia about the centre of mass. Else
    the pole's body is heavier and the cart's lighter; m, S and Jp, and with them all motion, stay
    the same.
    """
    if rig.pole_mass_kg is None or rig.com_distance_m is None or rig.pole_inertia_kg_m2 is None:
        return 0.0
    lightest = (rig.total_mass_kg * rig.com_distance_m) ** 2 / rig.pole_inertia_kg_m2
    if rig.pole_mass_kg > lightest:
        return rig.pole_mass_kg
    if rig.has_cart and HEAVIER * lightest >= rig.total_mass_kg:
        least = rig.pole_inertia_kg_m2 * HEAVIER * lightest / rig.total_mass_kg
        raise BadInputError(
            f"pole_inertia_kg_m2: expected above {least:.3g} for these masses and com_distance_m, "
            f"found {rig.pole_inertia_kg_m2:g}: no bodies move like that"
        )
    return HEAVIER * lightest


def _add_cart(robot: ET.Element, rig: Rig, friction: float) -> ET.Element:
    """Add cart and joint, and return the cart's link."""
    mass = rig.total_mass_kg - _compute_pole_mass(rig)
    link = _add_link(robot, "cart_link")
    _add_inertial(link, mass, 0.0, _compute_box_inertia(mass))
    joint = _add_joint(robot, CART, "prismatic", "rail_link", "cart_link", "1 0 0")
    ends = rig.rail_half_length_m or UNLIMITED
    effort = UNLIMITED if rig.pwm_limit is None else (rig.force_per_pwm_n or 0.0) * rig.pwm_limit
    # what the drive alone reaches without friction from one end of the rail to the other
    fastest = math.sqrt(2 * effort * 2 * ends / rig.total_mass_kg)
    speed = UNLIMITED if rig.rail_half_length_m is None or rig.pwm_limit is None else fastest
    limits = {"lower": -ends, "upper": ends, "effort": effort, "velocity": speed}
    ET.SubElement(joint, "limit", {key: repr(value) for key, value in limits.items()})
    ET.SubElement(
        joint, "dynamics", damping=repr(rig.cart_viscous_n_s_m or 0.0), friction=repr(friction)
    )
    return link


def _add_pole(robot: ET.Element, rig: Rig, carrier: ET.Element, friction: float) -> None:
    mass = _compute_pole_mass(rig)
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    centre = moment / mass
    across = (rig.pole_inertia_kg_m2 or 0.0) - moment * centre
    link = _add_link(robot, "pole_link")
    _add_inertial(link, mass, centre, (across, across, SLENDER * across))
    length = max(2 * centre, SHORTEST_ROD)
    rod = ET.Element("cylinder", length=repr(length), radius=repr(ROD_RADIUS))
    _add_visual(link, rod, f"0 0 {length / 2!r}", "pole", ORANGE)
    joint = _add_joint(robot, POLE, "continuous", str(carrier.get("name")), "pole_link", "0 -1 0")
    ET.SubElement(
        joint, "dynamics", damping=repr(rig.pole_viscous_n_m_s or 0.0), friction=repr(friction)
    )


def _get_friction(twin: Twin, effect: str, key: str) -> float:
    return twin.effects.get(effect, {}).get(key, 0.0)


def _make_rail(rig: Rig) -> ET.Element:
    length = 2 * (rig.rail_half_length_m or RAIL_IF_UNKNOWN)
    return ET.Element("box", size=_format_numbers(length, *RAIL_SIZE))


def _compute_box_inertia(mass: float) -> tuple[float, float, float]:
    x, y, z = (side**2 * mass / 12 for side in CART_SIZE)
    return y + z, x + z, x + y


def _add_link(robot: ET.Element, name: str) -> ET.Element:
    return ET.SubElement(robot, "link", name=name)


def _add_visual(link: ET.Element, shape: ET.Element, at: str, material: str, colour: str) -> None:
    visual = ET.SubElement(link, "visual")
    ET.SubElement(visual, "origin", xyz=at)
    ET.SubElement(visual, "geometry").append(shape)
    ET.SubElement(ET.SubElement(visual, "material", name=material), "color", rgba=colour)


def _add_inertial(
    link: ET.Element, mass: float, height: float, inertia: tuple[float, float, float]
) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_format_numbers(0.0, 0.0, height))
    ET.SubElement(inertial, "mass", value=repr(mass))
    ixx, iyy, izz = map(repr, inertia)
    ET.SubElement(inertial, "inertia", ixx=ixx, ixy="0", ixz="0", iyy=iyy, iyz="0", izz=izz)


def _add_joint(
    robot: ET.Element, name: str, kind: str, parent: str, child: str, axis: str
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "axis", xyz=axis)
    return joint


def _format_numbers(*values: float) -> str:
    return " ".join(map(repr, values))


def main(arguments: list[str] | None = None) -> int:
    """Print the URDF of a twin file; return 0, or 1 with a sentence on stderr."""
    parser = Parser(
        prog="twin_urdf",
        description="Print the rig of a twin file as a URDF.",
        examples=("twin_urdf config/inteco.yaml", "twin_urdf rig.yaml > rig.urdf"),
    )
    add_common_options(parser)
    parser.add_argument("twin", help="path of the twin file")
    complete(parser)
    try:
        print(make_urdf(load_twin(parser.parse_args(arguments).twin)), end="", flush=True)
    except BadInputError as error:
        print(f"twin_urdf: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main())

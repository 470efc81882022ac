"""Write docs/catalogue.md and pictures of the effects' signatures, or check that they are new.

A twin of config/inteco.yaml is driven by a chirp, without the effect and with it, at the strongest
that `rig_emulator` conceals. The third panel is what a diagnosis sees: the force, or torque, that
the motion with the effect needs beyond the twin's, over the variable that it depends on.
"""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from program_options import make_parser

from pendulum_bridge.emulator.concealable import BY_NAME as CONCEALABLE
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Place
from pendulum_twin.files import compute_digest
from pendulum_twin.inverse_dynamics import compute_missing_force
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals
from pendulum_twin.simulation import Simulation, simulate

DOCS = Path(__file__).resolve().parent
PAGE, PICTURES = DOCS / "catalogue.md", DOCS / "images" / "effects"
SHOWN = PICTURES / "shown.json"  # what the pictures show: a law that changed differs from it
ALIKE = 0.01  # of a figure there, up to which it is the same: other processors round otherwise
PERIOD_S, SECONDS, AMPLITUDE = 0.01, 12.0, 0.3  # of the chirp, 0.6 to 1.8 Hz; the limit is 0.5
GREY, BLUE, DPI = "#9a9a9a", "#1f6fb4", 90
Values = NDArray[np.float64]

# Sizes of what no emulated rig conceals, and of what belongs to a later time of a recording.
SIZES = {
    "thesis_dead_zones": {
        "force_n": 0.6,
        "cart_velocity_m_s": 0.01,
        "pole_velocity_rad_s": 0.1,
    },
    "encoder_slip": {"angle_rad": 0.3, "time_s": 6.0},
    "load_put_on": {"load_kg": 0.25, "time_s": 6.0},
    "cart_friction_asymmetry": {"ratio": 0.4},
}
BESIDE = {"cart_friction_asymmetry": {"cart_coulomb_friction": {"level_n": 1.0}}}
OVER_POSITION = (
    "force_ripple",
    "rail_spring",
    "rail_friction_patch",
    "rail_drag_patch",
    "cogging",
    "rail_tilt",
    "position_scale",
    "eccentric_pulley",
)
AT_CART = ("cart_sign_inverted", "position_scale", "eccentric_pulley", "sensor_delay")  # sensors
OVER_COMMAND = ("drive_slew_limit", "stretching_belt", "sensor_delay")
OVER_RATE = ("pole_coulomb_friction", "pole_quadratic_drag", "angle_delay", "angle_lag")
OVER_TIME = (
    "gain_drift",
    "friction_warming",
    "load_put_on",
    "periodic_force",
    "encoder_slip",
    "stale_start",
    "sample_period_error",
    "velocity_filter",
)
HEAD = """# The catalogue

<!-- written by `python docs/draw_signatures.py` -->
An effect is a small law at one place of the chain: command, drive, cart, pole, sensor, clock.
`sysid effects` prints the same list. In the pictures a twin is driven by the same chirp
without the effect (grey) and with it (blue). On the right stands what a diagnosis sees: the force
on the cart, or the torque on the pole, that the blue motion needs beyond the grey twin's, over the
variable that it depends on.

An effect that is not here: [add your own](howto_effect.md).
"""


def choose_sizes(effect: Effect) -> dict[str, float]:
    """Return parameters that show the effect: the strongest that an emulated rig conceals."""
    if effect.name in SIZES:
        return SIZES[effect.name]
    entry = CONCEALABLE[effect.name]
    return {
        name: float(np.mean(span))
        if name in entry.shapes
        else max(span, key=lambda size: abs(size - entry.neutral))
        for name, span in entry.sizes.items()
    }


def run(twin: Twin) -> tuple[Simulation, Values, Values]:
    """Return the motion of a twin, the times (s) and the commands."""
    t = np.arange(0.0, SECONDS, PERIOD_S)
    command = AMPLITUDE * np.cos(2 * np.pi * (0.6 + 0.05 * t) * t)
    return simulate(twin, t, command), t, command


def measure_force(motion: Simulation, command: Values, twin: Twin) -> tuple[Values, Values]:
    """Return the missing force and torque (n, 2) of a motion, and which samples count."""
    valid = np.ones(len(command), dtype=bool)
    signals = Signals(PERIOD_S, command, motion.cart, motion.pole, valid, valid)
    states = np.stack(
        [motion.cart, motion.pole, motion.cart_velocity, motion.pole_velocity], axis=1
    )
    accelerations = np.gradient(states[:, 2:], PERIOD_S, axis=0)
    return compute_missing_force(signals, states, accelerations, make_theta(twin))


@dataclass(frozen=True)
class Signature:
    """Hold what a picture shows.

    grey, blue: the motion without the effect and with it, at the times t, s.
    force: that the blue motion lacks, N, or the torque, N m, if it is the pole's.
    shown: which samples of it.
    """

    grey: Simulation
    blue: Simulation
    t: Values
    command: Values
    force: Values
    shown: NDArray[np.bool_]
    is_torque: bool

    def summarise(self) -> list[float]:
        """Return what the effect changes: cart, pole, missing force, as root mean squares."""
        moved = (self.blue.cart - self.grey.cart, self.blue.pole - self.grey.pole)
        parts = (*moved, self.force[self.shown])
        return [float(f"{np.sqrt(np.mean(part**2)):.5g}") for part in parts]


def compute_signature(effect: Effect, base: Twin) -> Signature:
    """Run a twin without an effect and with it."""
    beside = BESIDE.get(effect.name, {})
    without = replace(base, effects=beside)
    with_it = replace(base, effects={**beside, effect.name: choose_sizes(effect)})
    (grey, t, command), (blue, _, _) = run(without), run(with_it)
    force, counts = measure_force(blue, command, without)
    is_torque = effect.place in (Place.POLE, Place.SENSOR) and effect.name not in AT_CART
    shown = counts & (t > 0.1)
    return Signature(grey, blue, t, command, force[:, int(is_torque)], shown, is_torque)


def draw(effect: Effect, signature: Signature) -> Path:
    """Write the picture of an effect's signature; return its file."""
    t, blue, shown = signature.t, signature.blue, signature.shown
    variable, label = choose_variable(effect, blue, t, signature.command)
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(9.6, 2.3), layout="constrained")
    for axes, name, unit in ((left, "cart", "m"), (middle, "pole", "rad")):
        axes.plot(t, getattr(signature.grey, name), color=GREY, lw=1.4, ls="--")
        axes.plot(t, getattr(blue, name), color=BLUE, lw=1.4)
        axes.set(xlabel="time, s", ylabel=f"{name}, {unit}")
    force = signature.force[shown]
    spread = np.quantile(np.abs(force), 0.99) or 1.0
    right.plot(variable[shown], force, ".", color=BLUE, ms=2.5)
    right.set(
        xlabel=label,
        ylabel="torque, N m" if signature.is_torque else "force, N",
        ylim=(-1.3 * spread, 1.3 * spread),
    )
    for axes in (left, middle, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    PICTURES.mkdir(parents=True, exist_ok=True)
    file = PICTURES / f"{effect.name}.png"
    figure.savefig(file, dpi=DPI)
    Image.open(file).convert("RGB").quantize(32).save(file, optimize=True)
    plt.close(figure)
    return file


def choose_variable(
    effect: Effect, motion: Simulation, t: Values, command: Values
) -> tuple[Values, str]:
    """Return what the missing force of an effect depends on, with its name and unit."""
    if effect.name in OVER_TIME:
        return t, "time, s"
    if effect.name in OVER_POSITION:
        return motion.cart, "cart position, m"
    if effect.place is Place.COMMAND or effect.name in OVER_COMMAND:
        return command, "command"
    if effect.name in OVER_RATE:
        return motion.pole_velocity, "pole rate, rad/s"
    if effect.place in (Place.POLE, Place.SENSOR) and effect.name != "cart_sign_inverted":
        return motion.pole, "pole angle, rad"
    return motion.cart_velocity, "cart velocity, m/s"


def write_page() -> str:
    """Return the text of docs/catalogue.md."""
    blocks = [HEAD]
    for place in Place:
        blocks.append(f"## At the {place.value}\n")
        blocks += [describe(effect) for effect in CATALOGUE if effect.place is place]
    return "\n".join(blocks)


def describe(effect: Effect) -> str:
    """Return the section of an effect."""
    sizes = {**BESIDE.get(effect.name, {}), effect.name: choose_sizes(effect)}
    shown = "; ".join(
        f"`{name}: {{{', '.join(f'{key}: {value:.3g}' for key, value in values.items())}}}`"
        for name, values in sizes.items()
    )
    lines = [
        f"### {effect.name}\n",
        wrap(effect.sentence.replace("{", "`").replace("}", "`")) + "\n",
        f"![The motion with {effect.name}, and the force that it needs beyond the twin's]"
        f"(images/effects/{effect.name}.png)\n",
        wrap(
            f"Shown: {shown}. Source: {effect.source}."
            + ("" if effect.searched else " Only for twin files: no diagnosis names it.")
        )
        + "\n",
    ]
    return "\n".join(lines)


def wrap(text: str) -> str:
    """Return a paragraph in lines of at most 99 columns."""
    return textwrap.fill(text, 99, break_long_words=False, break_on_hyphens=False)


def list_stale(base: Twin) -> list[str]:
    """Return the effects whose law no longer makes what their picture shows."""
    kept = json.loads(SHOWN.read_text(encoding="utf-8"))
    stale = []
    for effect in CATALOGUE:
        old, file = kept.get(effect.name, {}), PICTURES / f"{effect.name}.png"
        is_same = file.is_file() and old.get("picture") == compute_digest([file])
        if is_same:
            now = compute_signature(effect, base).summarise()
            is_same = np.allclose(now, old["changes"], rtol=ALIKE, atol=1e-9)
        if not is_same:
            stale.append(effect.name)
    return stale


def main(arguments: Sequence[str] | None = None) -> int:
    """Write or check; return 1 when page or pictures are not what the catalogue says."""
    parser = make_parser("draw_signatures", __doc__, "", "--check")
    parser.add_argument("--check", action="store_true", help="write nothing, say what is stale")
    base = load_twin(DOCS.parent / "config" / "inteco.yaml")
    if parser.parse_args(arguments).check:
        stale = list_stale(base)
        if PAGE.read_text(encoding="utf-8") != write_page():
            stale.insert(0, PAGE.name)
        print("\n".join(stale), end="\n" if stale else "")
        return int(bool(stale))
    shown = {}
    for effect in CATALOGUE:
        signature = compute_signature(effect, base)
        picture = compute_digest([draw(effect, signature)])
        shown[effect.name] = {"changes": signature.summarise(), "picture": picture}
    lines = (f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in shown.items())
    SHOWN.write_text("{" + ",\n ".join(lines) + "}\n", encoding="utf-8")
    PAGE.write_text(write_page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

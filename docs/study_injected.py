"""Conceal known physics in recordings of real rigs, and diagnose them.

A recording is written anew as a rig would have written it that moved the same way and has one
effect more: a sensor's effect changes what it read, an effect on the command changes what was
logged for the command that acted, and a force on the cart is taken off the logged command. What a
real rig leaves without a name stays in the recording, so that the answer is known beside a real
rest. Prints the tables of docs/real_rigs.md.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from program_options import parse_study_of_rigs
from study_real_rigs import RIGS

import pendulum_sysid as ps
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.late_command import move_commands
from pendulum_twin.arrays import Floats
from pendulum_twin.command_line import run_command
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.inverse_dynamics import evaluate_laws
from pendulum_twin.parameter_vector import NEUTRAL, SLOTS
from pendulum_twin.sensors import apply_sensors
from pendulum_twin.signals import Signals

PARTS = {  # of a rig, that are diagnosed
    "inteco": "whole",
    "quanser": "all chirps",
    "sensorsini": "odd of 24",
    "emps": "whole",
}
DELAY_S = 0.02
SIZES: dict[str, Callable[[float, float], tuple[float, ...]]] = {
    # effect -> its parameters for the largest command and the largest force, N
    "angle_offset": lambda command, force: (0.03,),
    "eccentric_encoder": lambda command, force: (0.04, -0.03),
    "input_delay": lambda command, force: (DELAY_S,),
    "input_dead_zone": lambda command, force: (0.05 * command,),
    "gain_asymmetry": lambda command, force: (0.08,),
    "cart_coulomb_friction": lambda command, force: (0.06 * force,),
}


def conceal(
    recording: ps.Recording, name: str, sizes: tuple[float, ...], gain: float
) -> ps.Recording:
    """Return the recording as a rig with an effect more would have written it.

    sizes: of the effect's parameters.
    gain: force of the drive a unit of command, N.
    """
    signals, effect = recording.signals, BY_NAME[name]
    theta = NEUTRAL.copy()
    theta[SLOTS[name]] = sizes
    if effect.form is Form.MEASURE:
        return replace(recording, signals=_read_by(signals, theta))
    if name == "input_delay":
        command = move_commands(signals, round(sizes[0] / signals.period_s)).command
    elif effect.place is Place.COMMAND:
        assert effect.inverse is not None
        times_s = zip(signals.command, signals.clock_s, strict=True)
        command = np.array([effect.inverse(u, t, *sizes) for u, t in times_s])
    else:
        force = evaluate_laws(signals, smooth_state(signals).states, theta)[:, 0]
        command = signals.command - force / gain
    return replace(recording, signals=replace(signals, command=command, parts=None), doubt=None)


def _read_by(signals: Signals, theta: Floats) -> Signals:
    """Return what the sensors of theta (SIZE,) show of the positions."""
    states = np.zeros((1, len(signals), 4))
    for column, positions in enumerate((signals.cart, signals.pole)):
        if positions is not None:
            states[0, :, column] = positions
    cart, pole = apply_sensors(states, theta[None], signals.clock_s[None])[0, :, :2].T
    return replace(
        signals,
        cart=None if signals.cart is None else cart,
        pole=None if signals.pole is None else pole,
    )


def study(rig: str, rigs: Path, out: Path) -> None:
    """Print a line an effect: what the verdict says of it, and what else it says anew."""
    opened = RIGS[rig](rigs, out)
    twin = ps.load_twin(opened.twin)
    recordings = [ps.read_recording(bag) for bag in opened.parts[PARTS[rig]]]
    print(f"\n### {rig}, {PARTS[rig]}\n\n| concealed | told | other names | work, s |")
    print("|---|---|---|---|", flush=True)
    plain = _print_line("nothing", (), recordings, twin, None)
    gain = plain.rig_parameters["force_per_pwm_n"].after
    command = max(float(np.max(np.abs(each.signals.command))) for each in recordings)
    for name, choose in SIZES.items():
        if BY_NAME[name].place in (Place.SENSOR, Place.POLE) and not twin.rig.has_pole:
            continue
        sizes = choose(command, abs(gain) * command)
        hidden = [conceal(recording, name, sizes, gain) for recording in recordings]
        _print_line(name, sizes, hidden, twin, plain)


def _print_line(
    name: str,
    sizes: tuple[float, ...],
    recordings: list[ps.Recording],
    twin: ps.Twin,
    plain: ps.Verdict | None,
) -> ps.Verdict:
    """Diagnose, print a line of the table, and return the verdict.

    plain: the verdict on the untouched recordings; None where this is it.
    """
    began = time.process_time()
    verdict = ps.diagnose(recordings, twin)
    work = time.process_time() - began
    named = {m.effect: m for m in verdict.missing_physics}
    rivals = [e for e, m in named.items() if name in m.cannot_be_told_from]
    told = name if name in named else rivals[0] if rivals else ""
    before = {m.effect for m in (plain.missing_physics if plain else ())}
    others = [e for e in named if e != told]
    new = [f"**`{e}`**" if plain and e not in before else f"`{e}`" for e in others]
    laws = [f"`{law.law}`" for law in verdict.measured_laws]
    text = _describe(verdict, told) if told else "-"
    if not told and any(name == m.effect for m in verdict.perhaps):
        text = "`perhaps`"
    size = ", ".join(f"{each:.3g}" for each in sizes)
    print(f"| {name} {size} | {text} | {', '.join(new + laws) or '-'} | {work:.0f} |", flush=True)
    return verdict


def _describe(verdict: ps.Verdict, name: str) -> str:
    """Return an effect with its sizes and intervals."""
    (missing,) = (m for m in verdict.missing_physics if m.effect == name)
    sizes = (f"{p.value:.3g} [{p.low:.3g}, {p.high:.3g}]" for p in missing.parameters.values())
    return f"`{name}` {', '.join(sizes)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Study the rigs that are named, or all; return the exit status."""
    given = parse_study_of_rigs("study_injected", __doc__, PARTS, arguments)

    def study_each() -> None:
        given.out.mkdir(parents=True, exist_ok=True)
        for rig in given.names:
            study(rig, given.rigs, given.out)

    return run_command("study_injected", study_each, f"{given.out} holds what was made")


if __name__ == "__main__":
    sys.exit(main())

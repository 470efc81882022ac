"""Compare sizes fitted by free runs with sizes beside a latent force, and with a verdict's.

`sysid prove --pairs --rest --out PROOF` has recorded each concealed rig twice. Each fit is given
the same effects, on emulated rigs those that are concealed, and begins at the same sizes: what
differs is the fit alone.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from program_options import make_parser, read_folder
from study_real_rigs import RIGS, measure

import pendulum_sysid as ps
from pendulum_sysid.finding.replication import widen_intervals
from pendulum_sysid.finding.unnamed import widen_sizes
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.gauss_newton import take_step
from pendulum_sysid.fitting.latent_force import linearise_predictions, measure_latent_force
from pendulum_sysid.fitting.parameters import list_free_parameters, list_rig_parameters, make_twin
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_sysid.studies.proof.read_trial import read_seal
from pendulum_sysid.studies.proof.records import Seal
from pendulum_sysid.studies.proof.sizes import compute_mass_scale
from pendulum_twin.command_line import run_command
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.rig import UNITS

KINDS = ("free runs", "latent force", "verdict")
ROUNDS = 6  # of the latent force and the twin's parameters, in turns
DAMPING = 1e-6
# What all parts of a real rig share, and where fits of it begin.
SHARED: dict[str, dict[str, tuple[float, ...]]] = {
    "inteco": {"cart_sign_inverted": (1.0,), "cart_coulomb_friction": (0.5,)},
    "quanser": {
        "input_delay": (0.008,),
        "cart_coulomb_friction": (0.3,),
        "rail_tilt": (0.01,),
    },
    "emps": {"rail_tilt": (0.003,), "cart_coulomb_friction": (20.0,)},
}


def fit_each(
    bags: list[Path], twin: ps.Twin, effects: Mapping[str, Sequence[float]]
) -> tuple[Fit, Fit, Fit]:
    """Return fits by free runs, beside a latent force, and as a verdict tells them.

    effects: name -> the values at which the fits begin.
    """
    prepared = prepare([ps.read_recording(bag) for bag in bags], twin)
    case, split = prepared.case, prepared.split
    theta = make_theta(case.twin)
    for name, values in effects.items():
        theta[SLOTS[name]] = values
    for pieces in HORIZONS:
        free = fit(case, split, tuple(effects), theta, pieces)
        theta = free.theta
    return (
        widen_intervals(case, split, free),
        fit_beside_force(case, split, free),
        widen_sizes(case, split, free),
    )


def fit_beside_force(case: Case, split: Split, begun: Fit) -> Fit:
    """Return a fit with the sizes that are most likely beside a latent force, by Gauss and Newton.

    The intervals are those of the normal equations.
    """
    free = list_free_parameters(case.twin, begun.effects, case.scales)
    none = np.empty((0, begun.theta.size))
    reached = begun
    for _ in range(ROUNDS):
        latent = measure_latent_force(case, split, reached.theta)
        system = linearise_predictions(case, split, reached, latent, none)
        theta, _ = take_step(system, reached.theta, np.empty((0, 4)), free, DAMPING)
        reached = replace(reached, theta=theta)
    halves = 1.96 * np.sqrt(np.diag(np.linalg.pinv(system.normal)))
    estimates = {}
    for parameter, half in zip(free, halves * [p.size for p in free], strict=True):
        value = parameter.get(theta)
        old = begun.estimates[parameter.name]
        estimates[parameter.name] = replace(old, value=value, low=value - half, high=value + half)
    twin = make_twin(case.twin, theta, begun.effects, list_rig_parameters(case.twin))
    return replace(reached, twin=twin, estimates=estimates)


def list_sizes(fitted: Fit, seal: Seal, scale: float) -> Iterator[tuple[str, float, Estimate]]:
    """Yield name, truth and estimate of every size and constant; shapes are left out."""
    shapes = {f"{e.name}.{p.name}" for e in BY_NAME.values() for p in e.parameters if p.shape}
    for name, estimate in fitted.estimates.items():
        if name in shapes:
            continue
        if "." in name:
            effect, key = name.split(".")
            true = seal.effects[effect][key]
            unit = next(p.unit for p in BY_NAME[effect].parameters if p.name == key)
        else:
            true, unit = seal.rig[name], UNITS[name]
        by_mass = unit.split(" ")[0].split("/")[0] in ("N", "kg")
        yield name, true * scale if by_mass else true, estimate


def study(folder: Path) -> None:
    """Print each trial's errors on its other recording, and how near both fits come to the truth.

    Errors are root mean square errors of free runs of 1 s.
    """
    kept: dict[str, list[tuple[float, float, bool]]] = {kind: [] for kind in KINDS}
    overlaps: dict[str, list[bool]] = {kind: [] for kind in KINDS}
    print("| trial | concealed | other recording: free runs | latent force | verdict |")
    print("|---|---|---|---|---|")
    for trial in sorted(folder.glob("trials/trial_*")):
        if not (trial / "other").is_dir():
            continue
        seal, twin = read_seal(trial / "seal.json"), ps.load_twin(trial / "twin.yaml")
        scale = compute_mass_scale(seal, twin.rig)
        effects = {name: list(sizes.values()) or [1.0] for name, sizes in seal.effects.items()}
        each = [fit_each([trial / bag], twin, effects) for bag in ("bag", "other")]
        cells = []
        for k, kind in enumerate(KINDS):
            here, there = each[0][k], each[1][k]
            for fitted in (here, there):
                kept[kind] += [
                    (
                        abs(e.value / true - 1.0),
                        (e.high - e.low) / abs(true),
                        e.low <= true <= e.high,
                    )
                    for _, true, e in list_sizes(fitted, seal, scale)
                ]
            overlaps[kind] += [
                e.low <= there.estimates[name].high and there.estimates[name].low <= e.high
                for name, _, e in list_sizes(here, seal, scale)
            ]
            cells.append(measure([str(trial / "other")], here.twin))
        names = ", ".join(f"`{name}`" for name in seal.effects) or "-"
        print(f"| {trial.name[-4:]} | {names} | {' | '.join(cells)} |", flush=True)
    print("\n| fit | sizes | median error | median width | hold the truth | overlap |")
    print("|---|---|---|---|---|---|")
    for kind in KINDS:
        errors, widths, inside = np.array(kept[kind]).T
        print(
            f"| {kind} | {len(errors)} | {100 * np.median(errors):.2g} % "
            f"| {100 * np.median(widths):.2g} % | {100 * inside.mean():.3g} % "
            f"| {100 * np.mean(overlaps[kind]):.3g} % |"
        )


def study_rigs(rigs: Path, out: Path) -> None:
    """Print the sizes of real rigs as each of their parts has them."""
    for name, effects in SHARED.items():
        rig = RIGS[name](rigs, out)
        print(f"\n| {name}: part | parameter | {' | '.join(KINDS)} |\n|---|---|---|---|---|")
        for part, bags in rig.parts.items():
            each = fit_each(bags, ps.load_twin(rig.twin), effects)
            for parameter in each[0].estimates:
                sizes = [fitted.estimates[parameter] for fitted in each]
                cells = [f"{e.value:.3g} [{e.low:.3g}, {e.high:.3g}]" for e in sizes]
                print(f"| {part} | `{parameter}` | {' | '.join(cells)} |", flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Study the proof, and the real rigs if they are given; return the exit status."""
    examples = ("out/pairs", "out/pairs recordings out/latent")
    parser = make_parser("study_latent_force", __doc__, *examples)
    add = parser.add_argument
    add("proof", type=read_folder, metavar="PROOF", help="folder of the proof")
    add("rigs", type=read_folder, nargs="?", metavar="RIGS", help="recordings of real rigs")
    add("out", type=Path, nargs="?", metavar="OUT", help="folder for the parts of these")
    given = parser.parse_args(arguments)
    if given.rigs and not given.out:
        parser.error("expected OUT after RIGS, found nothing")

    def study_all() -> None:
        study(given.proof)
        if given.rigs:
            study_rigs(given.rigs, given.out)

    return run_command("study_latent_force", study_all, "what was printed stays right")


if __name__ == "__main__":
    sys.exit(main())

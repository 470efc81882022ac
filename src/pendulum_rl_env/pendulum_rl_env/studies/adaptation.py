"""A rig that changes while it is controlled: noticed, diagnosed, and controlled again.

A rig (MuJoCo, in real time, driven over topics) is recorded for a minute and diagnosed; a policy
is trained in the identified twin and drives the rig, and the watch learns what is usual. Then the
rig changes in motion. When the watch says so, a fresh minute is recorded and diagnosed, and the
policy is trained on in the new twin. A classical controller that is designed anew stands beside
it. Times are wall times from the change.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pendulum_bridge.emulator.conceal import conceal_effects
from pendulum_bridge.emulator.load import add_load
from pendulum_bridge.studies.emulated_graph import APPLIED_TOPIC
from pendulum_rl_env.control.design import Controller, design_controller
from pendulum_rl_env.learning.policies import load_controller
from pendulum_rl_env.studies.adaptation_report import draw_rewards, format_table
from pendulum_rl_env.studies.changing_rig import ChangingRig, open_rig
from pendulum_rl_env.studies.stages import train_policy
from pendulum_rl_env.studies.workers import run_program
from pendulum_rl_env.task import Task
from pendulum_sysid import cli
from pendulum_twin.command_line import run_command
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parser import Parser, add_common_options, complete

SCHEMA = "pendulum_adaptation/1"
GOOD_REWARD = 440.0  # what is asked of a controller after the change
MORE_DELAY_S, LOAD_KG = 0.02, 0.2
FRICTION = "cart_coulomb_friction"
MOST_EPISODES = 12  # in which the watch is to learn what is usual, and to see the change
CHANGE_AT_STEP = 200  # of an episode: the pole is up
MORE_STEPS = 25_600  # for which the old policy is trained on: two evaluations, 10 s
OLD, NEW = "policy of the old twin", "policy of the new twin"
OLD_CLASSICAL, NEW_CLASSICAL = "classical of the old twin", "classical of the new twin"

RUN = "python -m pendulum_rl_env.studies.adaptation"


def _double_friction(rig: Twin) -> Twin:
    level_n = 2 * rig.effects[FRICTION]["level_n"]
    return replace(rig, effects={**rig.effects, FRICTION: {"level_n": level_n}})


def _delay_commands(rig: Twin) -> Twin:
    return replace(rig, effects={**rig.effects, "input_delay": {"delay_s": MORE_DELAY_S}})


def _load_cart(rig: Twin) -> Twin:
    return replace(rig, rig=add_load(rig.rig, LOAD_KG))


CHANGES: Mapping[str, tuple[str, Callable[[Twin], Twin]]] = {
    "friction": ("the cart's dry friction doubles", _double_friction),
    "delay": (f"commands act {1e3 * MORE_DELAY_S:g} ms later", _delay_commands),
    "load": (f"a load of {LOAD_KG:g} kg is put on the cart", _load_cart),
}


@dataclass(frozen=True)
class Identified:
    """Hold what a minute's recording led to.

    twin, verdict, policy: files.
    """

    twin: Path
    verdict: Path
    policy: Path

    def design_classical(self) -> Controller:
        """Return the classical controller that is designed from the twin."""
        return design_controller(load_twin(self.twin), Task())

    @property
    def answer(self) -> dict[str, Any]:
        """Return the verdict's sentence and its warnings."""
        verdict = json.loads(self.verdict.read_text(encoding="utf-8"))
        return {key: verdict[key] for key in ("sentence", "warnings")}


def main(arguments: list[str] | None = None) -> int:
    """Run the study; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command("adaptation", lambda: _study(options), "all programs have ended")


def _study(options: argparse.Namespace) -> None:
    out: Path = options.out
    if out.exists() and any(out.iterdir()):
        raise BadInputError(f"{out}: expected an empty folder, or none: give another --out")
    out.mkdir(parents=True, exist_ok=True)
    report = (lambda _: None) if options.quiet else _say
    truth = _draw_rig(options)
    nominal, rig = out / "nominal.yaml", out / "rig.yaml"
    save_twin(Twin("nominal", load_twin(options.twin).rig), nominal)
    save_twin(truth, rig)
    with open_rig(out / "before", rig, None, nominal) as live:
        report("Recording a minute of the rig as it is ...")
        live.record(out / "before" / "recording", nominal)
    before = _identify(out / "before", nominal, options.seed)
    report(f"  {before.answer['sentence']}")
    rows = []
    for name in options.changes:
        words, change = CHANGES[name]
        folder = out / name
        save_twin(change(truth), folder.with_suffix(".yaml"))
        with open_rig(folder, rig, folder.with_suffix(".yaml"), before.twin) as live:
            rows.append({"change": words, **_adapt(live, folder, before, options.seed, report)})
        study = {"schema": SCHEMA, "seed": options.seed, "good": GOOD_REWARD, "changes": rows}
        write_atomically(out / "adaptation.json", json.dumps(study, indent=2) + "\n")
    write_atomically(out / "adaptation.md", format_table(study) + "\n")
    draw_rewards(study, out / "adaptation.png")
    print(format_table(study))


def _draw_rig(options: argparse.Namespace) -> Twin:
    """Return the true rig: constants that the seed draws, and dry friction of its cart."""
    sealed = conceal_effects((FRICTION,), options.seed, load_twin(options.twin).rig)
    return Twin("rig", sealed.rig, sealed.effects)


def _adapt(
    live: ChangingRig,
    folder: Path,
    before: Identified,
    seed: int,
    report: Callable[[str], None],
) -> dict[str, Any]:
    """Let the rig change under the old policy, and control it again; return what came of it."""
    old = load_controller(before.policy, live.task)
    _settle(live, old)
    report("The watch has learned; the rig changes ...")
    noticed_s = _change_and_notice(live, old)
    report(f"  {noticed_s:.0f} s: {live.alarm or 'not noticed'}")
    live.record(folder / "recording", before.twin)
    recorded_s = live.now_s
    diagnosed_s: list[float] = []
    now = _identify(
        folder, before.twin, seed, before.policy, lambda: diagnosed_s.append(live.now_s)
    )
    trained_s = live.now_s
    report(f"  {trained_s:.0f} s: {now.answer['sentence']}")
    new = load_controller(now.policy, live.task)
    first = live.play(NEW, new)
    back_s = live.now_s
    report(f"  {back_s:.0f} s: an episode of the new policy has ended, reward {first.reward:.0f}")
    for name, controller in (
        (NEW, new),
        (OLD, old),
        (NEW_CLASSICAL, now.design_classical()),
        (OLD_CLASSICAL, before.design_classical()),
    ):
        live.play(name, controller)
    return {
        "alarm": live.alarm,
        **now.answer,
        "noticed_s": noticed_s,
        "recorded_s": recorded_s,
        "diagnosed_s": diagnosed_s[0],
        "trained_s": trained_s,
        "back_s": back_s,
        "episodes": [
            {
                "controller": episode.controller,
                "start_s": episode.start_s,
                "step_s": episode.step_s,
                "reward": episode.reward,
                "rewards": [round(reward, 4) for reward in episode.rewards],
            }
            for episode in live.episodes
        ],
    }


def _settle(live: ChangingRig, controller: Controller) -> None:
    """Play episodes until the watch has learned what is usual."""
    for _ in range(MOST_EPISODES):
        live.play(OLD, controller)
        if live.has_learned:
            return
    raise BadInputError(
        f"expected the watch to learn within {MOST_EPISODES} episodes, found it still learning"
    )


def _change_and_notice(live: ChangingRig, controller: Controller) -> float:
    """Let the rig change within an episode; return the time at which the watch has said so.

    Where the watch says nothing, the time is that of the last episode's end.
    """

    def change_once(k: int) -> bool:
        if k == CHANGE_AT_STEP:
            if live.alarm:
                raise BadInputError(f"expected no alarm before the change, found: {live.alarm}")
            live.change()
        return k > CHANGE_AT_STEP and bool(live.alarm)

    steps = len(live.play(OLD, controller, change_once).rewards)
    if steps <= CHANGE_AT_STEP:
        raise BadInputError(
            f"expected the policy to keep the pole up until the change at step {CHANGE_AT_STEP}, "
            f"found an episode of {steps} steps"
        )
    for _ in range(MOST_EPISODES):
        if live.alarm:
            break
        live.play(OLD, controller, lambda k: bool(live.alarm))
    return live.now_s


def _identify(
    folder: Path,
    believed: Path,
    seed: int,
    policy: Path | None = None,
    diagnosed: Callable[[], None] = lambda: None,
) -> Identified:
    """Diagnose a folder's recording and train a policy in the identified twin.

    believed: file of the twin that the recording is compared with.
    policy: file of the policy that is trained on; None trains a new policy.
    diagnosed: is called between diagnosis and training.
    """
    out = folder / "diagnosis"
    words = ["diagnose", str(folder / "recording"), "--twin", str(believed), "--out", str(out)]
    run_program("sysid diagnose", cli.main, [*words, "--command-topic", APPLIED_TOPIC])
    diagnosed()
    twin, verdict = out / "twin.yaml", out / "verdict.json"
    how = ["--preset", "residual", "--verdict", str(verdict)]
    if policy is not None:
        how += ["--init", str(policy), "--timesteps", str(MORE_STEPS)]
    trained = train_policy(twin, folder / "policy", seed, how)
    return Identified(twin, verdict, trained)


_say: Callable[[str], None] = partial(print, flush=True)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="adaptation",
        description=__doc__,
        examples=(
            f"{RUN} --seed 1 --out out/adaptation",
            f"{RUN} --seed 1 --changes load --out out/load",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add("--seed", type=int, required=True, help="of the rig's constants, and of the training")
    add("--out", type=Path, required=True, help="folder for recordings, twins and policies")
    add("--twin", type=Path, default=Path("config/inteco.yaml"), help="the nominal rig")
    kinds = "what changes (default: all)"
    add("--changes", nargs="+", choices=list(CHANGES), default=list(CHANGES), help=kinds)
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())

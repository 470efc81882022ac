"""What to do after a diagnosis: a list of steps, with commands to copy."""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from pathlib import PurePosixPath

from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.light import BLUE, Light
from pendulum_sysid.telling.window_list import WindowRow
from pendulum_sysid.verdict.drawn import Origin
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.user_effects import OPTION, VARIABLE

NEXT_RECORDING = "next_recording"
PLAYING = (
    "Beside the driver (namespace /rig), start the recorder in a terminal of its own, play "
    "the plan, and end the recorder with Ctrl-C."
)


@dataclass(frozen=True)
class Step:
    """Hold one step: a sentence, the commands for it, and a place of the page to look at.

    link: (address, words); empty for none.
    """

    sentence: str
    commands: tuple[str, ...] = ()
    link: tuple[str, str] | None = None


def list_steps(verdict: Verdict, light: Light, worst: WindowRow | None) -> tuple[Step, ...]:
    """Return what to do now, the most useful first.

    worst: the window that the improved twin follows least; None without windows.
    """
    origin = verdict.origin
    if verdict.outcome is Outcome.UNUSABLE:
        return (_check(origin), Step("Record again, and diagnose the new recording."))
    if verdict.unlike_rig:
        first = (_check(origin), *_look(worst), Step("Record again if the files are right."))
        return (*first, *_play(verdict))
    if verdict.rig_changed:
        return (Step("Diagnose each recording by itself."), *_look(worst))
    use = _use(verdict, light) if verdict.twin is not None else ()
    look = _look(worst) if light.colour != BLUE else ()
    return (*use, *_play(verdict), *look, *_judge(origin))


def _check(origin: Origin | None) -> Step:
    sentence = "Check that the recording and the twin file belong to the same rig."
    if origin is None:
        return Step(sentence)
    words = ["sysid", "check", *origin.recordings, *_list_options(origin), "--twin", origin.twin]
    return Step(sentence, (shlex.join(words),))


def _use(verdict: Verdict, light: Light) -> tuple[Step, ...]:
    care = "" if light.colour == BLUE else ", and mind what remains"
    sentence = f"Use the improved twin in place of the twin as given{care}."
    if verdict.origin is None:
        return (Step(sentence),)
    known = _set_variable(verdict.origin)
    twin, said = (_join(verdict.origin, name) for name in ("twin.yaml", "verdict.json"))
    return (
        Step(
            sentence,
            (
                f"{known}twin_node --ros-args -p {shlex.quote(f'twin:={twin}')}",
                known
                + shlex.join(["train", "--twin", twin, "--verdict", said, "--out", "policy"]),
            ),
        ),
    )


def _play(verdict: Verdict) -> tuple[Step, ...]:
    """Return the step that plays the plan of the next experiment, and diagnoses both together."""
    if verdict.next_experiment is None:
        return ()
    why = verdict.next_experiment.why
    sentence = f"Play the next experiment: {why[:1].lower()}{why[1:]}"
    origin = verdict.origin
    if origin is None:
        return (Step(sentence),)
    plan = _join(origin, verdict.next_experiment.file)
    record = f"recorder_node --ros-args -p out:={NEXT_RECORDING} -p {shlex.quote(f'plan:={plan}')}"
    twin_file = shlex.quote(f"twin_file:={origin.twin}")
    play = (
        f"{_set_variable(origin)}excitation_node --ros-args -r __ns:=/excitation "
        f"-p {shlex.quote(f'plan:={plan}')} -p {twin_file} -p \"twin:=''\" -p listeners:=2"
    )
    words = ["sysid", "diagnose", *origin.recordings, NEXT_RECORDING, *_list_options(origin)]
    words += ["--hold", ",".join(origin.constants)] if origin.constants else []
    both = shlex.join([*words, "--twin", origin.twin, "--out", f"{origin.folder}_next"])
    return (Step(f"{sentence} {PLAYING}", (record, play, both)),)


def _look(worst: WindowRow | None) -> tuple[Step, ...]:
    if worst is None:
        return ()
    sentence = (
        f"Look at window {worst.number}, from {worst.begin_s:.1f} to {worst.end_s:.1f} s: of the "
        "held-out windows, the improved twin follows it least."
    )
    return (Step(sentence, (), ("#windows", f"window {worst.number}")),)


def _judge(origin: Origin | None) -> tuple[Step, ...]:
    sentence = "Judge both twins on a recording that this diagnosis has not seen."
    if origin is None:
        return (Step(sentence),)
    words = ["sysid", "compare", "another_recording", *_list_options(origin)]
    twins = ["--twin", origin.twin, "--twin", _join(origin, "twin.yaml")]
    return (Step(sentence, (shlex.join([*words, *twins]),)),)


def _list_options(origin: Origin) -> list[str]:
    """Return the options with which `sysid` reads these recordings and twins again."""
    folders = [word for folder in origin.effects for word in (OPTION, folder)]
    return [*origin.topics, *folders]


def _set_variable(origin: Origin) -> str:
    """Return what stands before a command of another program, so that it knows the effects."""
    if not origin.effects:
        return ""
    return f"{VARIABLE}={shlex.quote(os.pathsep.join(origin.effects))} "


def _join(origin: Origin, name: str) -> str:
    return str(PurePosixPath(origin.folder) / name)

"""The command `sysid`: parse, call, print, exit status.

Exit status: 0 the question was answered; 1 it could not be, the reason on stderr in one sentence; 2 wrong use. What a
verb needs is imported when it runs, so that help comes at once.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from dataclasses import astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.options import parser
from pendulum_twin.errors import BadInputError

if TYPE_CHECKING:
    from pendulum_sysid.records import Comparison, Diagnosis, Recording
    from pendulum_twin.model import Twin

ANSWERED, NOT_ANSWERED, INTERRUPTED = 0, 1, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status; argparse ends wrong use with status 2 by itself."""
    arguments = parser().parse_args(argv)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a run that overflows is reported as such, not as numpy sees it
            status = VERBS[arguments.verb](arguments)
            sys.stdout.flush()
        return status
    except BadInputError as error:
        return _say(str(error))
    except KeyboardInterrupt:
        return _say("stopped by the keyboard before the question was answered", INTERRUPTED)
    except BrokenPipeError:  # the reader of our output has gone; Python would complain once more at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return NOT_ANSWERED
    except Exception as error:
        if arguments.traceback:
            raise
        kind = type(error).__name__
        return _say(f"internal error ({kind}: {error}): please report it, with --traceback for details")


def _say(sentence: str, status: int = NOT_ANSWERED) -> int:
    """Print a sentence on stderr, on one line, and return the status."""
    print("sysid:", " ".join(sentence.split()), file=sys.stderr, flush=True)
    return status


def _progress(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


# The verbs


def _diagnose(arguments: argparse.Namespace) -> int:
    from pendulum_sysid import pipeline
    from pendulum_sysid.output_files import check_folder
    from pendulum_sysid.records import Outcome
    from pendulum_twin.model import load_twin

    check_folder(arguments.out)
    twin = load_twin(arguments.twin)
    recordings = _recordings(arguments.bag, arguments)
    diagnosis = pipeline.diagnose(recordings, twin, _progress)
    written = _write_diagnosis(diagnosis, arguments.out, arguments.twin)
    sentence = diagnosis.verdict["sentence"]
    unusable = diagnosis.verdict["outcome"] == Outcome.UNUSABLE.value
    print(*([] if unusable else [sentence]), *written, sep="\n")
    return _say(sentence) if unusable else ANSWERED


def _write_diagnosis(diagnosis: Diagnosis, folder: Path, started_from: Path) -> list[Path]:
    """Write what was found and return the files; an improved twin of an earlier diagnosis must not stand beside it."""
    from pendulum_sysid.output_files import json_text, write_text, writing
    from pendulum_sysid.report import write_report
    from pendulum_sysid.verdict import NEXT_FILE
    from pendulum_twin.model import save_twin
    from pendulum_twin.plans.plan_file import plan_from_mapping, save_plan

    verdict, report, improved = folder / "verdict.json", folder / "report.html", folder / "twin.yaml"
    coming = folder / NEXT_FILE
    with writing(folder):
        if diagnosis.twin is None and improved.exists() and not improved.samefile(started_from):
            improved.unlink()
        coming.unlink(missing_ok=True)
        if diagnosis.next_plan is not None:
            save_plan(plan_from_mapping(diagnosis.next_plan), coming)
        write_text(verdict, json_text(diagnosis.verdict) + "\n")
        if diagnosis.twin is not None:
            save_twin(diagnosis.twin, improved)
        write_report(diagnosis, report)
    there = (verdict, report, improved if diagnosis.twin else None, coming if diagnosis.next_plan else None)
    return [path for path in there if path is not None]


def _fit(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.output_files import check_file, writing
    from pendulum_twin.model import load_twin, save_twin

    if arguments.method == "windows" and arguments.max_evaluations is not None:
        arguments.parser.error("--max-evaluations goes with --method thesis")
    check_file(arguments.out)
    twin = load_twin(arguments.twin)
    recording = _joined(_answered(arguments.bag, arguments))
    by_method = {"windows": _fit_windows, "thesis": _fit_thesis}
    fitted = by_method[arguments.method](recording, twin, arguments)
    with writing(arguments.out):
        save_twin(fitted, arguments.out)
    print(f"\n{arguments.out}")
    return ANSWERED


def _fit_windows(recording: Recording, twin: Twin, arguments: argparse.Namespace) -> Twin:
    from pendulum_sysid.case import case_of
    from pendulum_sysid.fit import HORIZONS, fit
    from pendulum_sysid.split import split as cut_in_three
    from pendulum_sysid.tables import ESTIMATES, estimate_rows, held_out_rows, table
    from pendulum_sysid.window_runs import run_windows
    from pendulum_twin.words import words_of

    case = case_of(recording, twin)
    split = cut_in_three(case.signals, case.state)
    words = words_of(case.twin)
    for parts in HORIZONS:  # short horizons first: they lead there from far away
        found = fit(case, split, tuple(case.twin.effects), words, parts)
        words = found.words
    runs = [run_windows(replace(case, twin=one), split.held_out) for one in (case.twin, found.twin)]
    if not found.converged:
        _progress("the fit stopped before it had settled: more may be gained by fitting again from its result")
    print(table(ESTIMATES, estimate_rows(case.twin, found)))
    if runs[1].score > runs[0].score:
        _progress("the fit is worse on windows it has not seen: no parameter repairs what is missing; ask sysid diagnose")
    print(f"\n{len(split.held_out)} held-out windows, which the fit has not seen")
    print(table(("", "before", "after", "unit"), held_out_rows(*runs)))
    return found.twin


def _fit_thesis(recording: Recording, twin: Twin, arguments: argparse.Namespace) -> Twin:
    from pendulum_sysid.tables import number, table
    from pendulum_sysid.thesis_fit import MOST_EVALUATIONS, thesis_fit

    found = thesis_fit(recording, twin, _progress, arguments.max_evaluations or MOST_EVALUATIONS)
    if found.dropped:
        _progress(f"left out, for the thesis's model does not have it: {', '.join(found.dropped)}")
    rows = [
        (m.name, number(m.start), number(m.fitted), number(m.percent, 3), m.unit, "at its bound" if m.at_bound else "")
        for m in found.moved
    ]
    print(table(("parameter", "start", "fitted", "moved by %", "unit", ""), rows))
    end = "settled" if found.converged else "stopped at the limit, not settled"
    print(f"\nequation 29 on the fitted record: {number(found.before)} before, {number(found.after)} after")
    print(f"{found.evaluations} evaluations, {end}; nothing was held out")
    return found.twin


def _replay(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.compare import compare
    from pendulum_sysid.output_files import json_text
    from pendulum_sysid.tables import comparison_rows, table
    from pendulum_twin.model import load_twin

    twin = load_twin(arguments.twin)
    found = compare(_answered([arguments.bag], arguments)[0], twin)
    _say_if_diverged(arguments.twin, found)
    if arguments.json:
        print(json_text(_replay_mapping(found)))
    else:
        print(f"{found.count} windows of {found.seconds:g} s")
        print(table(("measure", str(arguments.twin), "unit"), comparison_rows([found])))
    return ANSWERED


def _replay_mapping(found: Comparison) -> dict:
    windows = {
        "seconds": found.seconds,
        "count": found.count,
        "cart_rmse_m": found.cart_rmse_m,
        "pole_rmse_rad": found.pole_rmse_rad,
        "score": found.score,
    }
    return {"windows": windows, "whole": {"thesis_rmse": found.thesis_rmse}}


def _say_if_diverged(name: Path, found: Comparison) -> None:
    if not all(math.isfinite(value) for value in astuple(found) if value is not None):
        _say(f"{name}: a run of this twin diverged, so that its error is no number (JSON: null)")


def _compare(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.compare import compare_two
    from pendulum_sysid.output_files import check_file
    from pendulum_sysid.tables import comparison_rows, table
    from pendulum_twin.model import load_twin

    if len(arguments.twin) != 2:
        arguments.parser.error(f"expected --twin A --twin B, found --twin {len(arguments.twin)} time(s)")
    names = (str(arguments.twin[0]), str(arguments.twin[1]))
    if arguments.out is not None:
        from pendulum_sysid.compare_plot import check_format, draw

        check_format(arguments.out)
        check_file(arguments.out)
    twins = [load_twin(path) for path in arguments.twin]
    recording = _answered([arguments.bag], arguments)[0]
    pair = compare_two(recording, *twins)
    for path, one in zip(arguments.twin, pair.comparisons, strict=True):
        _say_if_diverged(path, one)
    print(f"{pair.comparisons[0].count} windows of {pair.comparisons[0].seconds:g} s")
    print(table(("measure", *names, "unit"), comparison_rows(pair.comparisons)))
    print(f"\n{names[1]} is the better one in {pair.second_better} windows of {pair.comparisons[0].count}")
    if arguments.out is not None:
        draw(arguments.out, recording.name, names, pair.runs)
        print(arguments.out)
    return ANSWERED


def _effects(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.catalogue_text import catalogue_mapping, catalogue_text
    from pendulum_sysid.output_files import json_text

    if arguments.isolability:
        return _isolability(arguments)
    if arguments.twin is not None or arguments.plan is not None:
        arguments.parser.error("--twin and --plan go with --isolability")
    print(json_text(catalogue_mapping()) if arguments.json else catalogue_text())
    return ANSWERED


def _isolability(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.isolability import Encoders, isolability
    from pendulum_sysid.isolability_text import isolability_mapping, isolability_text
    from pendulum_sysid.output_files import json_text
    from pendulum_twin.model import load_twin
    from pendulum_twin.plans.excitation import standard
    from pendulum_twin.plans.plan_file import load_plan
    from pendulum_twin.plans.waveforms import envelope_of

    if arguments.twin is None or arguments.plan is None:
        arguments.parser.error("--isolability needs --twin and --plan")
    twin = load_twin(arguments.twin)
    room = envelope_of(twin.rig)
    plan = standard(room) if arguments.plan == "standard" else load_plan(arguments.plan, room)
    found = isolability(twin, plan, Encoders(arguments.pole_counts, arguments.cart_step_m))
    print(json_text(isolability_mapping(found)) if arguments.json else isolability_text(found))
    return ANSWERED


def _import(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.importing import import_csv

    if arguments.cart is None and arguments.pole is None:
        arguments.parser.error("expected --cart, --pole or both, found neither")
    import_csv(
        arguments.csv,
        arguments.out,
        time=arguments.time,
        command=arguments.command,
        cart=arguments.cart,
        pole=arguments.pole,
        pole_zero=arguments.pole_zero,
        skip=arguments.skip,
        invert_cart=arguments.invert_cart,
        invert_pole=arguments.invert_pole,
    )
    print(arguments.out)
    return ANSWERED


def _next(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.next_verb import run

    run(_joined(_answered(arguments.bag, arguments)), arguments, _progress)
    return ANSWERED


def _prove(arguments: argparse.Namespace) -> int:
    from pendulum_sysid.prove.verb import run

    run(arguments, _progress)
    return ANSWERED


# What the verbs share


def _answered(paths: list[Path], arguments: argparse.Namespace) -> list[Recording]:
    """Return the recordings without what goes before the cart's first answer, as a diagnosis judges them."""
    from pendulum_sysid.unanswered import without_unanswered

    return [without_unanswered(one) for one in _recordings(paths, arguments)]


def _recordings(paths: list[Path], arguments: argparse.Namespace) -> list[Recording]:
    """Return the recordings, read and cleaned; raise BadInputError when one cannot be used or stands there twice."""
    from pendulum_sysid.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
    from pendulum_sysid.quality import cleaned

    topics = arguments.state_topic or STATE_TOPIC, arguments.command_topic or COMMAND_TOPIC
    found: dict[str, Recording] = {}
    for path in paths:
        raw = read_bag(path, *topics)
        if raw.digest in found:
            raise BadInputError(f"{path}: expected every recording once, found this one twice: name each once")
        try:
            found[raw.digest] = cleaned(raw)
        except BadInputError as error:
            raise BadInputError(f"{path}: {error}") from error
    return list(found.values())


def _joined(recordings: list[Recording]) -> Recording:
    """Return several recordings of one rig as one, each its own stretch."""
    from pendulum_sysid.records import Recording
    from pendulum_twin.signals import joined

    if len(recordings) == 1:
        return recordings[0]
    name, digest = (" + ".join(parts) for parts in zip(*((r.name, r.digest) for r in recordings), strict=True))
    return Recording(name, digest, joined([r.signals for r in recordings]))


VERBS: dict[str, Callable[[argparse.Namespace], int]] = {
    "diagnose": _diagnose,
    "fit": _fit,
    "replay": _replay,
    "compare": _compare,
    "effects": _effects,
    "import": _import,
    "next": _next,
    "prove": _prove,
}

if __name__ == "__main__":
    sys.exit(main())

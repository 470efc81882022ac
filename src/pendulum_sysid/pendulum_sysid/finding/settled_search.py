"""Search with commands at the samples from which they acted, as far as the twin can say.

Commands may be late, all by the same time (`late_command`), may act when they come
(`commands_at_once`), or it may be in doubt which of two samples each came with. The constants
alone settle what they can before a search, and what the search ends at settles the rest; where
that changes a command, the search begins again.
"""

from __future__ import annotations

from dataclasses import replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.commands_at_once import take_commands_at_once
from pendulum_sysid.finding.journal import Progress, Search, report_nothing
from pendulum_sysid.finding.late_command import move_late_commands
from pendulum_sysid.finding.search import Answer, search_effects
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.acting_commands import settle_by_twin
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.fitting.trimmed_fit import fit_to_better_half
from pendulum_sysid.fitting.unexplained_windows import leave_out_unexplained
from pendulum_sysid.records import Split
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import make_theta

TURNS = 3  # at most: a search after which commands are settled begins again
SETTLING = "asking from which samples on the commands acted"


def search_settled(
    case: Case, split: Split, report: Progress = report_nothing
) -> tuple[Case, Split, Answer]:
    """Return the case with doubtful commands settled, its windows, and what its twin lacks.

    report: takes a line of progress for a person.
    """
    report(SETTLING)
    given = tuple(case.twin.effects), make_theta(case.twin)
    case = take_commands_at_once(move_late_commands(case, split, *given), split, *given)
    if case.recording.doubt is not None:
        quick = Search(replace(case, step_s=decisions.SEARCH_STEP_S), split)
        case = settle_by_twin(case, fit_parameters_alone(quick).theta)
    answer = search_effects(case, split, report)
    for _ in range(TURNS):
        report(SETTLING)
        settled, windows = settle_commands(case, split, answer.best.effects, answer.best.theta)
        if settled is case:
            break
        case, split = settled, windows
        answer = search_effects(case, split, report)
    return case, split, answer


def settle_commands(
    case: Case, split: Split, effects: tuple[str, ...], theta: Floats
) -> tuple[Case, Split]:
    """Return the case with commands where the twin says, and its windows.

    Where nothing changes they are those that were given. Windows go that no command explains.

    effects, theta: of the twin, (SIZE,).
    """
    moved = move_late_commands(case, split, effects, theta)
    moved = take_commands_at_once(moved, split, effects, theta)
    if moved.recording.doubt is None:
        return moved, split
    trimmed = fit_to_better_half(moved, effects, theta)
    settled = leave_out_unexplained(settle_by_twin(moved, trimmed), trimmed)
    if settled is case:
        return case, split
    return settled, split_windows(settled.signals, settled.state)

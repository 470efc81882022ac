"""Search with commands at the samples from which they acted, as far as the twin can say.

Where commands are in doubt, the constants alone settle what they can before a search, and what the
search ends at settles the rest; where that changes a command, the search begins again.
"""

from __future__ import annotations

from dataclasses import replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Progress, Search, report_nothing
from pendulum_sysid.finding.search import Answer, search_effects
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.acting_commands import settle_by_twin
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Split

TURNS = 3  # at most: a search after which commands are settled begins again
SETTLING = "asking from which samples on the commands acted"


def search_settled(
    case: Case, split: Split, report: Progress = report_nothing
) -> tuple[Case, Answer]:
    """Return the case with doubtful commands settled, and what its twin lacks.

    report: takes a line of progress for a person.
    """
    if case.recording.doubt is None:
        return case, search_effects(case, split, report)
    report(SETTLING)
    quick = Search(replace(case, step_s=decisions.SEARCH_STEP_S), split)
    case = settle_by_twin(case, fit_parameters_alone(quick).theta)
    answer = search_effects(case, split, report)
    for _ in range(TURNS):
        report(SETTLING)
        settled = settle_by_twin(case, answer.best.theta)
        if settled is case:
            break
        case = settled
        answer = search_effects(case, split, report)
    return case, answer

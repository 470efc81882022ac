"""Find a channel that is counted the wrong way round, before any physics is asked about."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid import decisions
from pendulum_sysid.finding.growth import grow_set
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.parameter_vector import SLOTS, make_theta

SIGNS = tuple(effect.name for effect in CATALOGUE if effect.is_switch)


def fit_parameters_alone(search: Search) -> Fit:
    """Return the best fit of the rig's constants alone, with a wrong sign turned.

    Mirroring cart, pole and command together changes nothing, so one wrong sign at a time covers
    every case.
    """
    case, given = search.case, tuple(search.case.twin.effects)
    theta = make_theta(case.twin)
    plain = fit(case, search.split, given, theta, HORIZONS[0])
    search.journal.note(plain, "parameters alone")
    turned = []
    for sign in SIGNS:
        if sign not in given and _can_be_seen(case, sign):
            other = theta.copy()
            other[SLOTS[sign]] = 1.0
            turned.append(fit(case, search.split, (*given, sign), other, HORIZONS[0]))
            search.journal.note(turned[-1], "one sign turned")
    best = min(turned, key=lambda candidate: candidate.choose, default=plain)
    if best.choose * decisions.FAULT_SURE_RATIO < plain.choose:
        return best
    most = decisions.SIGN_MISFIT_RATIO * plain.choose
    return settle_sign(search, plain, [other for other in turned if other.choose < most])


def settle_sign(search: Search, plain: Fit, doubtful: Sequence[Fit]) -> Fit:
    """Return the doubtful sign with which a search ends better, else the plain fit.

    Under a wrong scale of the angle a wrong sign fits as badly as the right sign, and under dry
    friction near upright it fits somewhat better. A sign that was no better before has to end at
    the noise.

    plain: the constants alone.
    doubtful: the constants with one sign turned each, not much worse.
    """
    if not decisions.SETTLE_DOUBTFUL_SIGNS:
        return plain
    grown: Fit | None = None
    for turned in sorted(doubtful, key=lambda candidate: candidate.choose):
        search.journal.report(
            f"misfit {plain.choose:.2f}, and {turned.choose:.2f} with {turned.effects[-1]}: "
            "asking what either lacks"
        )
        end = grow_set(search, turned).choose
        was_ahead = turned.choose * decisions.SIGN_MISFIT_RATIO < plain.choose
        if end > decisions.MISFIT_AT_NOISE and not was_ahead:
            continue
        grown = grown or grow_set(search, plain)
        if end * decisions.SIGN_MISFIT_RATIO < grown.choose:
            return turned
    return plain


def _can_be_seen(case: Case, sign: str) -> bool:
    rig = case.twin.rig
    if rig.has_cart and rig.has_pole:
        return True
    return rig.has_cart and not BY_NAME[sign].needs_both_joints

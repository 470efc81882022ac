"""List the parameters of which a measured law can hold a share."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.penalised_fit import LawFit, list_all_free, list_parts


def list_shared_parameters(case: Case, law_fit: LawFit) -> tuple[str, ...]:
    """Return the parameters of rig and effects that the laws of a fit can imitate.

    A drag along the rail changes the motion as the viscous constant does: the motion fixes the sum
    of both. The prior of the law gives the constant the whole mean over the places of this
    recording. The prior is a convention, so it does not count here: least squares of the
    parameter's column of the normal equations on the columns of the laws leave hardly anything.
    """
    system, curves = law_fit.system, law_fit.curves
    if system is None or not curves:
        return ()
    free = list_all_free(case, law_fit.fit.effects, law_fit.fit.theta, curves)
    own = list_parts(len(free), curves)[0].start
    normal = system.normals.sum(axis=0)
    across, within = normal[:own, own:], normal[own:, own:]
    taken = np.einsum(
        "pk,pk->p", across @ np.linalg.pinv(within, rcond=1e-10, hermitian=True), across
    )
    shares = taken / np.maximum(np.diag(normal)[:own], np.finfo(float).tiny)
    return tuple(
        parameter.name
        for parameter, share in zip(free[:own], shares, strict=True)
        if share > decisions.LAW_SHARES_PARAMETER
    )

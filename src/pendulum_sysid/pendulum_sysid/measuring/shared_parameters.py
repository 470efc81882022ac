"""Which parameters a measured law can take over: of both together, only the sum is known."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.penalised_fit import LawFit, list_all_free, list_parts


def list_shared_parameters(case: Case, law_fit: LawFit) -> tuple[str, ...]:
    """Return the parameters of rig and effects that the laws of a fit can take over.

    A law of the cart's drag along the rail may hold any share of the viscous constant, and the
    motion is the same. Such a parameter changes the motion as the laws' values can change it, too:
    least squares of its column of the normal equations on those of the laws leave hardly anything.
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

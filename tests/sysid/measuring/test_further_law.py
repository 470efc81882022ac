"""A law more is fitted beside what a fit holds."""

from dataclasses import replace

import numpy as np
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.measuring import further_law
from pendulum_sysid.measuring.measure import begin_without_laws
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law, make_curve_matrix
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import LAWS

RIG = Twin("rig", INTECO.rig)


def test_a_law_is_fitted_from_where_it_is_nothing(monkeypatch):
    """Its errors begin as those of the fit without; finer knots keep the law's values."""
    knots = np.linspace(-1.8, 1.8, 61)
    law = {"cart_force_by_position": Law(tuple(knots), tuple(-3.0 * knots**3))}
    prepared = prepare([made(replace(RIG, measured_laws=law), 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    (candidate,) = [
        ranked
        for ranked in rank_curves(case, split, begun)
        if ranked.curve.kind.name == "cart_force_by_position"
    ]
    fits = []
    fit_laws = further_law.fit_laws

    def keep(case, split, start, curves, *about, **named):
        law_fit = fit_laws(case, split, start, curves, *about, **named)
        fits.append((start, law_fit, named.get("least_gain")))
        return law_fit

    monkeypatch.setattr(further_law, "fit_laws", keep)
    monkeypatch.setattr(decisions, "LAW_MOST_EFFECTIVE", 0.0)  # always finer
    further_law.fit_longer(case, split, begun, candidate)
    (empty, coarse, _), (start, fine, _) = fits[:2]
    assert not np.any(coarse.curves[-1].get_values(empty.theta))
    np.testing.assert_array_equal(empty.theta[:LAWS], begun.fit.theta[:LAWS])
    np.testing.assert_array_equal(start.theta[:LAWS], coarse.fit.theta[:LAWS])
    np.testing.assert_array_equal(start.start_states, coarse.fit.start_states)
    (few,), (many,) = coarse.curves, fine.curves
    spread = make_curve_matrix(few.kind, few.knots, many.knots)
    assert len(many.knots) == 2 * len(few.knots)
    np.testing.assert_allclose(many.get_values(start.theta), spread @ coarse.values[-1])
    assert [gain for *_, gain in fits] == [decisions.LAW_FIRST_GAIN] * (len(fits) - 1) + [None]

"""A law more is fitted beside what a fit holds."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_fits import make_fit
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.measuring import further_law, measure
from pendulum_sysid.measuring.measure import begin_without_laws
from pendulum_sysid.measuring.penalised_fit import LawFit
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


@pytest.mark.parametrize(
    ("finished", "kept", "asked", "best"),
    [
        # the best first fit is finished, and the others are not
        ({"a": 2.0}, ("a",), ["finish a", "ask a"], "a"),
        # it errs more than the next, which is finished as well
        ({"a": 5.0, "b": 3.5}, ("a", "b"), ["finish a", "finish b", "ask b"], "b"),
        # what is not kept gives way to the next best
        (
            {"a": 5.0, "b": 3.5, "c": 6.0},
            ("c",),
            ["finish a", "finish b", "ask b", "finish c", "ask a", "ask c"],
            "c",
        ),
        ({"a": 2.0, "b": 3.5, "c": 4.5}, (), None, None),
        # a fit that nothing fixes cannot be finished
        ({"a": None, "b": 3.5}, ("b",), ["finish a", "finish b", "ask b"], "b"),
    ],
)
def test_laws_are_finished_and_asked_best_first(finished, kept, asked, best, monkeypatch):
    """Finishing takes as long as all before; a finished fit may err more than its first fit."""
    begun = [_make_law_fit(name, left) for name, left in (("c", 4.0), ("a", 2.5), ("b", 3.0))]
    done = []

    def finish(case, split, law_fit, shorter):
        name = law_fit.fit.effects[0]
        done.append(f"finish {name}")
        if finished[name] is None:
            raise np.linalg.LinAlgError
        return _make_law_fit(name, finished[name], lead=compute_lead(law_fit.fit, law_fit.fit))

    def keep(longer, shorter, most_waiting, small):
        name = longer.law_fit.fit.effects[0]
        done.append(f"ask {name}")
        return name in kept

    monkeypatch.setattr(measure, "finish_longer", finish)
    monkeypatch.setattr(measure, "_is_kept", keep)
    shorter = measure.Measured(None, None, _make_law_fit("", 9.0))
    taken = measure._take_best(shorter, begun, 0, small=False)
    assert (taken and taken.law_fit.fit.effects[0]) == best
    assert asked is None or done == asked


def _make_law_fit(name, left, lead=None):
    """Return a fit that leaves so many units of noise."""
    fit = make_fit(np.full((6, 2), left), (name,))
    return LawFit(fit, (), (), (), (), 1.0, None, lead)

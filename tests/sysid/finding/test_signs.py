"""A sign is turned at once where that explains far more, else by what searches end at."""

from types import SimpleNamespace

import pytest
from support.made_recordings import INTECO

from pendulum_sysid.finding import signs
from pendulum_sysid.finding.journal import Journal

TURNED = "angle_sign_inverted"


@pytest.mark.parametrize(
    ("plain", "turned", "grown_plain", "grown_turned", "is_turned"),
    [
        (432.0, 9.8, None, None, True),  # a realistic rest beside a wrong sign: no search
        (9.2, 7.4, 0.9, 5.0, False),  # dry friction in a loop near upright
        (9.2, 7.4, 1.05, 1.0, False),
        (9.2, 7.4, 6.0, 3.0, True),  # neither ends at the noise, and the sign was ahead
        (9.2, 9.0, 6.0, 3.0, False),
        (9.2, 9.0, 6.0, 1.05, True),  # a wrong scale of the angle beside a wrong sign
        (9.2, 12.0, None, None, False),  # no doubt
    ],
)
def test_a_sign_is_turned_where_the_search_with_it_ends_better(
    monkeypatch: pytest.MonkeyPatch,
    plain: float,
    turned: float,
    grown_plain: float | None,
    grown_turned: float | None,
    is_turned: bool,
) -> None:
    def make_fit(effects: tuple[str, ...], choose: float | None) -> SimpleNamespace:
        if choose is None:
            pytest.fail("searched where nothing is in doubt")
        return SimpleNamespace(effects=effects, train=choose, choose=choose)

    def fit(case, split, effects, theta, horizon) -> SimpleNamespace:
        misfits = {(): plain, (TURNED,): turned}
        return make_fit(effects, misfits.get(effects, 100.0 * plain))

    def grow(search, fit) -> SimpleNamespace:
        return make_fit(fit.effects, grown_turned if TURNED in fit.effects else grown_plain)

    monkeypatch.setattr(signs, "fit", fit)
    monkeypatch.setattr(signs, "grow_set", grow)
    case = SimpleNamespace(twin=INTECO)
    search = SimpleNamespace(case=case, split=None, journal=Journal())
    best = signs.fit_parameters_alone(search)
    assert best.effects == ((TURNED,) if is_turned else ())

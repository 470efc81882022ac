"""A filter of the reported velocities is found; plain differences and mere delays are none."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO, record_hidden, report_rates

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.velocity_filter import read_filter
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Estimate, Recording
from pendulum_twin.parameter_vector import make_theta


def read_constant(recording: Recording) -> Estimate | None:
    """Return the time constant (s) that the detector reads."""
    case = prepare_case([recording], INTECO)
    readings = read_filter(Sight(case, make_theta(case.twin)))
    return readings[0].estimates["time_constant_s"] if readings else None


@pytest.mark.parametrize("time_constant_s", [0.012, 0.02, 0.0755, 0.1])
def test_the_time_constant_is_found(time_constant_s: float) -> None:
    """The recording reports differences, which the detector does not know."""
    effects = {"velocity_filter": {"time_constant_s": time_constant_s}}
    constant = read_constant(record_hidden(effects, 1, 20.0)[0])
    assert constant is not None
    assert constant.value == pytest.approx(time_constant_s, rel=0.05)
    assert constant.low < time_constant_s < constant.high


@pytest.mark.parametrize("late", [0, 1, 2])
def test_differences_and_delays_are_no_filter(late: int) -> None:
    recording, _ = record_hidden({}, 1, 20.0)
    assert recording.rates is not None
    delayed = replace(recording, rates=np.roll(recording.rates, late, axis=0))
    assert read_constant(delayed) is None


def test_nothing_is_said_without_reported_velocities() -> None:
    recording, _ = record_hidden({}, 1, 20.0)
    assert read_constant(replace(recording, rates=None)) is None


def test_wild_velocities_do_not_decide() -> None:
    recording, _ = record_hidden({}, 2, 20.0)
    signals = recording.signals
    assert signals.cart is not None and signals.pole is not None
    rates = report_rates(np.stack([signals.cart, signals.pole], axis=1), 0.02)
    rates[::150] += 300.0
    constant = read_constant(replace(recording, rates=rates))
    assert constant is not None
    assert constant.value == pytest.approx(0.02, rel=0.1)

"""The next experiment sharpens a measured law: its band shrinks as promised."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.made_recordings import made_bag
from support.measured_laws import measure_beside_constants
from support.tied_recordings import INTECO, ROOM, make_gentle_sweep, record_plan, record_twin

from pendulum_sysid.cli import main
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.planning.law_aims import list_band_narrowings
from pendulum_sysid.planning.next_experiment import plan_next_experiment
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin, save_twin
from pendulum_twin.plans.plan_file import load_plan

FORCE, WAYS = "cart_force_by_position", "cart_hysteresis"
AT = np.linspace(-1.8, 1.8, 61)
RIG = Twin("rig", INTECO.rig)
TRUTH = replace(RIG, measured_laws={FORCE: Law(tuple(AT), tuple(0.03 * np.sin(9.0 * AT)))})


def measure_force(recordings: list[Recording]) -> Measured:
    measured = measure_beside_constants(recordings, RIG)
    assert measured.kinds == (FORCE,)
    return measured


def list_bands(measured: Measured) -> dict[str, Floats]:
    return {law.curve.kind.name: law.band for law in measured.named[1]}


@pytest.fixture(scope="module")
def first() -> tuple[Recording, Measured]:
    """Return a gentle recording of the force, and the law that is measured on it."""
    recording = record_twin(TRUTH, make_gentle_sweep(10, 0.1))
    return recording, measure_force([recording])


def test_a_band_shrinks_as_promised(first: tuple[Recording, Measured]) -> None:
    """Within a factor of two: the law is measured anew, and its smoothness chosen anew."""
    recording, measured = first
    bands = list_bands(measured)
    planned = plan_next_experiment(
        measured.case, measured.split, measured.named[0], (), "law", bands=bands
    )
    assert planned.plan is not None and planned.before is not None and planned.after is not None
    assert planned.before == pytest.approx(np.mean(bands[FORCE]), rel=0.1)
    assert planned.after < 0.7 * planned.before
    assert planned.why.startswith(f"{FORCE} is known to +-") and "N on average" in planned.why
    again = measure_force([recording, record_plan(TRUTH, planned.plan)]).named[1][0]
    visited, at = measured.named[1][0].curve.knots, again.curve.knots
    there = (visited[0] <= at) & (at <= visited[-1])  # the plan goes further
    band = again.band[there].mean()
    assert band < 0.9 * planned.before
    assert 0.5 * planned.after < band < 2.0 * planned.after


def test_a_law_that_only_was_given_is_no_aim(first: tuple[Recording, Measured]) -> None:
    measured = first[1]
    fit = measured.named[0]
    assert not list_band_narrowings(measured.case, measured.split, fit, {})
    planned = plan_next_experiment(measured.case, measured.split, fit, (), "law")
    assert planned.plan is None and "no measured law" in planned.why


def test_the_command_sharpens_the_laws_of_a_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A formula has many knots, elements that remember have none between them."""
    ways = Law((1e-3, 1e-2, 1e-1), (0.02, 0.02, 0.02))
    truth = replace(TRUTH, measured_laws={**TRUTH.measured_laws, WAYS: ways})
    made_bag(tmp_path / "bag", record_twin(truth, make_gentle_sweep(10, 0.1)))
    save_twin(INTECO, tmp_path / "nominal.yaml")
    save_twin(truth, tmp_path / "twin.yaml")
    laws = [
        {"law": FORCE, "low": [-0.01] * len(AT), "high": [0.01] * len(AT)},
        {"law": WAYS, "low": [0.0, 0.01, 0.01], "high": [0.04, 0.03, 0.03]},
    ]
    verdict = {
        "schema": "pendulum_verdict/1", "outcome": "not_in_catalogue", "missing_physics": [],
        "measured_laws": laws,
    }  # fmt: skip
    (tmp_path / "verdict.json").write_text(json.dumps(verdict))
    words = [
        "next", str(tmp_path / "bag"), "--twin", str(tmp_path / "nominal.yaml"), "--out",
        str(tmp_path / "next.yaml"), "--verdict", str(tmp_path / "verdict.json"),
    ]  # fmt: skip
    assert main([*words, "--for", "law"]) == 0
    assert f"{WAYS} is known to +-0.013 N on average" in capsys.readouterr().out
    assert main(words) == 0
    assert f"{FORCE} is known to +-0.01 N on average" in capsys.readouterr().out
    assert load_plan(tmp_path / "next.yaml", ROOM).seconds == pytest.approx(20.0, abs=0.05)

"""The step of a coarse command is read off the balance of the force, whatever the constants."""

import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.coarse_command import read_step
from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.prepare import prepare, prepare_case
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize(
    "known",
    [{}, {"input_delay": {"delay_s": 0.013}}, {"input_sign_inverted": {}}],
    ids=["plain", "late", "mirrored"],
)
def test_the_step_is_the_truth(known: dict[str, dict[str, float]]) -> None:
    """With the wrong sign of the force, a mirrored drive's step reads about twice as large."""
    recording, _ = record_hidden({**known, "coarse_command": HIDDEN["coarse_command"]}, 1, 20.0)
    case = prepare_case([recording], INTECO)
    ((step,),) = (
        r.values for r in read_step(Sight(case, make_theta(Twin("t", INTECO.rig, known))))
    )
    assert step == pytest.approx(HIDDEN["coarse_command"]["step"], rel=2e-3)


def test_a_fit_tells_step_and_gain_apart() -> None:
    """A step that rounds no command to another side only changes the gain."""
    recording, truth = record_hidden({"coarse_command": HIDDEN["coarse_command"]}, 1, 20.0)
    prepared = prepare([recording], INTECO)
    case, split = prepared.case, prepared.split
    theta = make_theta(Twin("t", INTECO.rig, {"coarse_command": HIDDEN["coarse_command"]}))
    fitted = fit(case, split, ("coarse_command",), theta, HORIZONS[0])
    step, gain = (fitted.estimates[name] for name in ("coarse_command.step", "force_per_pwm_n"))
    assert step.identifiable and step.high - step.low < 0.005 * step.value
    assert gain.identifiable and gain.low < truth.rig.force_per_pwm_n < gain.high


def test_a_pole_alone_has_no_command() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_step(Sight(case, make_theta(case.twin))) == ()

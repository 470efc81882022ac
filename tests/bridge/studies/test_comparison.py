"""The demo's table says right exactly where names and intervals agree with the seal."""

import pytest
from support.verdicts import make_missing_entry, make_verdict

from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.studies.comparison import Comparison, format_comparison, read_verdict
from pendulum_sysid.studies.proof.records import NamesJudgement, NamesOutcome, Size
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

FRICTION = "cart_coulomb_friction"
HIT = {"level_n": (0.72, 0.71, 0.74)}
MISS = {"level_n": (0.803, 0.80, 0.81)}


@pytest.fixture
def concealed(nominal: Rig) -> Concealed:
    rig = Rig(**{**nominal.to_mapping(), "cart_viscous_n_s_m": 0.44, "force_per_pwm_n": 11.0})
    return Concealed({FRICTION: {"level_n": 0.73}}, rig)


def test_one_outcome_alone_reads_right() -> None:
    right = "The diagnosis is right: "
    assert [way for way in NamesOutcome if way.sentence.startswith(right)] == [NamesOutcome.RIGHT]


def test_a_right_verdict_reads_right(concealed: Concealed, nominal: Rig) -> None:
    text = format_comparison(concealed, nominal, make_verdict(make_missing_entry(FRICTION, **HIT)))
    lines = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    assert lines[f"{FRICTION}:"].strip() == f"{FRICTION}: named"
    assert lines["level_n"].split() == ["level_n", "0.73", "0.72", "[0.71,", "0.74]", "N", "right"]
    assert (
        " ".join(lines["cart_viscous_n_s_m"].split())
        == "cart_viscous_n_s_m 0.5 0.44 0.44 [0.43, 0.45] N s/m right"
    )
    assert lines["gravity_m_s2"].endswith("not identifiable")
    assert lines["force_per_pwm_n"].split() == ["force_per_pwm_n", "12.86", "11", "-"]
    assert "31 before, 1.2 after (score; noise floor 1)" in text
    assert "Masking: cart_viscous_n_s_m had absorbed it." in text
    assert text.endswith(NamesOutcome.RIGHT.sentence)


def test_an_interval_that_misses_the_truth_is_not_called_right(
    concealed: Concealed, nominal: Rig
) -> None:
    text = format_comparison(
        concealed, nominal, make_verdict(make_missing_entry(FRICTION, **MISS))
    )
    assert "off by +10 %" in text and "diagnosis is right" not in text
    assert text.endswith(
        "The names are right, but the interval of cart_coulomb_friction.level_n misses the truth."
    )


@pytest.mark.parametrize("outcome", [NamesOutcome.TIED, NamesOutcome.INCOMPLETE])
def test_a_miss_is_said_of_answers_that_read_half_right(outcome: NamesOutcome) -> None:
    """Also of 'right up to a tie' and of an incomplete answer."""
    sizes = [
        Size("rig", "cart_viscous_n_s_m", "N s/m", False, 2.0, 1.0, 0.9, 1.1),
        Size("rig", "force_per_pwm_n", "N", False, 12.0, 12.1, 11.9, 12.3),
    ]
    sentence = Comparison(
        NamesJudgement(outcome), {(size.owner, size.parameter): size for size in sizes}
    ).sentence
    assert sentence.startswith(outcome.sentence)
    assert sentence.endswith("And the interval of rig.cart_viscous_n_s_m misses the truth.")


def test_a_constant_whose_interval_misses_the_truth_is_named_too(nominal: Rig) -> None:
    concealed = Concealed({FRICTION: {"level_n": 0.73}}, nominal)  # true viscous friction: 0.5
    text = format_comparison(
        concealed, nominal, make_verdict(make_missing_entry(FRICTION, **MISS))
    )
    assert text.endswith(
        "The names are right, but the intervals of cart_coulomb_friction.level_n, "
        "rig.cart_viscous_n_s_m miss the truth."
    )


@pytest.mark.parametrize(
    ("entries", "outcome"),
    [
        ([make_missing_entry(FRICTION)], NamesOutcome.RIGHT),
        ([make_missing_entry("rail_tilt")], NamesOutcome.WRONG),
        ([], NamesOutcome.MISSED),
        ([make_missing_entry("rail_tilt"), make_missing_entry(FRICTION)], NamesOutcome.WRONG),
        ([make_missing_entry("rail_tilt", [FRICTION])], NamesOutcome.TIED),
        ([make_missing_entry(FRICTION, ["rail_tilt"])], NamesOutcome.RIGHT),
    ],
)
def test_the_conclusion_is_the_judges(
    concealed: Concealed, nominal: Rig, entries: list, outcome: NamesOutcome
) -> None:
    assert format_comparison(concealed, nominal, make_verdict(*entries)).endswith(outcome.sentence)


def test_how_each_effect_was_named_is_shown(concealed: Concealed, nominal: Rig) -> None:
    def show(*entries: dict) -> str:
        return format_comparison(concealed, nominal, make_verdict(*entries))

    assert f"{FRICTION}: not named\n" in show(make_missing_entry("rail_tilt", angle_rad=(1, 0, 2)))
    assert "rail_tilt: was not concealed" in show(make_missing_entry("rail_tilt"))
    assert f"{FRICTION}: named (cannot be told from rail_tilt)" in show(
        make_missing_entry(FRICTION, ["rail_tilt"])
    )
    assert f"{FRICTION}: not named, but rail_tilt, which this recording cannot tell from it" in (
        show(make_missing_entry("rail_tilt", [FRICTION]))
    )


def test_nothing_concealed_and_nothing_named_is_right(nominal: Rig) -> None:
    rig = Rig(**{**nominal.to_mapping(), "cart_viscous_n_s_m": 0.44})
    text = format_comparison(Concealed({}, rig), nominal, make_verdict(outcome="nothing_missing"))
    assert "none concealed, none found" in text and text.endswith(NamesOutcome.RIGHT.sentence)


def test_a_false_alarm_is_called_wrong(nominal: Rig) -> None:
    verdict = make_verdict(make_missing_entry("rail_tilt"))
    assert format_comparison(Concealed({}, nominal), nominal, verdict).endswith(
        NamesOutcome.FALSE_ALARM.sentence
    )


def test_a_verdict_that_lacks_an_entry_is_refused(
    concealed: Concealed, nominal: Rig, tmp_path
) -> None:
    with pytest.raises(BadInputError, match="verdict: expected what pendulum_verdict/1 holds"):
        format_comparison(
            concealed, nominal, {"schema": "pendulum_verdict/1", "missing_physics": []}
        )
    (tmp_path / "verdict.json").write_text("{}")
    with pytest.raises(BadInputError, match="expected a verdict with schema"):
        read_verdict(tmp_path / "verdict.json")

"""The demo's table says right where the verdict is right; its failures are one sentence."""

import json
import sys

import pytest
from support.paths import CONFIG

from pendulum_bridge.emulator.comparison import Answer, answer, read_verdict, table
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.studies import demo
from pendulum_sysid.reading.bag import read_bag
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

PLAN = "schema: pendulum_plan/1\nrate_hz: 100\nphases: [{kind: push}, {kind: rest, seconds: 1}]\n"
CONFIG = CONFIG / "inteco.yaml"


def physics(effect: str, ties=(), **parameters) -> dict:
    values = {
        k: {"value": v, "low": low, "high": high, "unit": "N"}
        for k, (v, low, high) in parameters.items()
    }
    return {
        "effect": effect,
        "cannot_be_told_from": list(ties),
        "confidence": 0.99,
        "parameters": values,
    }


def verdict(*missing: dict) -> dict:
    return {
        "schema": "pendulum_verdict/1",
        "outcome": "named",
        "sentence": "Dry friction holds the cart back with 0.72 N.",
        "missing_physics": list(missing),
        "rig_parameters": {
            "cart_viscous_n_s_m": {
                "before": 0.5, "after": 0.44, "low": 0.43, "high": 0.45, "unit": "N s/m", "identifiable": True,
            },
            "gravity_m_s2": {
                "before": 9.81, "after": 9.81, "low": 0.0, "high": 100.0, "unit": "m/s^2", "identifiable": False,
            },
        },
        "masking": ["cart_viscous_n_s_m had absorbed it"],
        "fit": {
            "train": {"before": 30.0, "after": 1.1}, "held_out": {"before": 31.0, "after": 1.2},
            "noise_floor": 1.0, "unit": "score",
        },
    }  # fmt: skip


@pytest.fixture
def concealed(nominal: Rig) -> Concealed:
    rig = Rig(**{**nominal.to_mapping(), "cart_viscous_n_s_m": 0.44, "force_per_pwm_n": 11.0})
    return Concealed({"cart_coulomb_friction": {"level_n": 0.73}}, rig)


def test_a_right_verdict_reads_right(concealed: Concealed, nominal: Rig) -> None:
    text = table(
        concealed, nominal, verdict(physics("cart_coulomb_friction", level_n=(0.72, 0.71, 0.74)))
    )
    lines = {line.split()[0]: line for line in text.splitlines() if line.strip()}
    assert lines["cart_coulomb_friction:"].strip() == "cart_coulomb_friction: named"
    assert lines["level_n"].split() == ["level_n", "0.73", "0.72", "[0.71,", "0.74]", "N", "right"]
    assert (
        " ".join(lines["cart_viscous_n_s_m"].split())
        == "cart_viscous_n_s_m 0.5 0.44 0.44 [0.43, 0.45] N s/m right"
    )
    assert lines["gravity_m_s2"].endswith("not identifiable")
    assert lines["force_per_pwm_n"].split() == ["force_per_pwm_n", "12.86", "11", "-"]
    assert "31 before, 1.2 after (score; noise floor 1)" in text
    assert "Masking: cart_viscous_n_s_m had absorbed it." in text
    assert text.endswith(Answer.RIGHT.value)


def test_a_value_outside_its_interval_is_called_off(concealed: Concealed, nominal: Rig) -> None:
    text = table(
        concealed, nominal, verdict(physics("cart_coulomb_friction", level_n=(0.803, 0.80, 0.81)))
    )
    assert "off by +10 %" in text


@pytest.mark.parametrize(
    ("missing", "expected"),
    [
        ([physics("cart_coulomb_friction")], Answer.RIGHT),
        ([physics("rail_tilt")], Answer.WRONG),
        ([], Answer.WRONG),
        ([physics("rail_tilt"), physics("cart_coulomb_friction")], Answer.PARTLY),
        ([physics("rail_tilt", ties=["cart_coulomb_friction"])], Answer.UNDECIDED),
        ([physics("cart_coulomb_friction", ties=["rail_tilt"])], Answer.RIGHT),
    ],
)
def test_answers(concealed: Concealed, nominal: Rig, missing: list, expected: Answer) -> None:
    assert answer(concealed, verdict(*missing)) is expected
    assert expected.value in table(concealed, nominal, verdict(*missing))


def test_nothing_concealed_and_nothing_found_is_right(nominal: Rig) -> None:
    text = table(Concealed({}, nominal), nominal, verdict())
    assert "none concealed, none found" in text and text.endswith(Answer.RIGHT.value)


def test_a_verdict_that_lacks_something_is_refused(
    concealed: Concealed, nominal: Rig, tmp_path
) -> None:
    with pytest.raises(BadInputError, match="verdict: expected what pendulum_verdict/1 holds"):
        table(concealed, nominal, {"schema": "pendulum_verdict/1", "missing_physics": []})
    (tmp_path / "verdict.json").write_text("{}")
    with pytest.raises(BadInputError, match="expected a verdict with schema"):
        read_verdict(tmp_path / "verdict.json")


@pytest.fixture
def sysid(tmp_path, monkeypatch):
    """Stand in for the diagnosis: a script that runs the given Python."""

    def make(python: str) -> None:
        script = tmp_path / "sysid"
        script.write_text(f"#!{sys.executable}\nimport json, pathlib, sys\n{python}\n")
        script.chmod(0o755)
        monkeypatch.setattr(demo, "SYSID", script)

    return make


def test_the_demo_runs_from_concealing_to_the_answer(sysid, tmp_path, capsys) -> None:
    given = verdict(physics("rail_tilt"))
    sysid(
        "assert sys.argv[7:] == ['--command-topic', '/rig/applied_pwm'], sys.argv\n"
        "assert sys.argv[1] == 'diagnose' and sys.argv[3] == '--twin' and sys.argv[5] == '--out', sys.argv\n"
        "assert pathlib.Path(sys.argv[2], 'metadata.yaml').is_file() and pathlib.Path(sys.argv[4]).is_file()\n"
        f"out = pathlib.Path(sys.argv[6]); out.mkdir(); (out / 'verdict.json').write_text({json.dumps(given)!r})"
    )
    (tmp_path / "plan.yaml").write_text(PLAN)
    options = ["--seed", "3", "--twin", str(CONFIG), "--plan", str(tmp_path / "plan.yaml")]
    for _ in range(2):  # an earlier demo's folder is used again
        assert demo.main(["--out", str(tmp_path / "out"), *options]) == 0
    said = capsys.readouterr().out
    assert "--seed 3" in said and str(tmp_path / "out" / "diagnosis" / "report.html") in said
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "seal.json",
        "recording",
        "nominal_twin.yaml",
        "diagnosis",
        "logs",
    }
    recorded = read_bag(tmp_path / "out" / "recording", command_topic=demo.APPLIED)
    assert recorded.state_stamp_s[-1] > 2 and max(abs(recorded.command)) == pytest.approx(0.3)


def test_a_failed_diagnosis_is_one_sentence(sysid, tmp_path, monkeypatch, capfd) -> None:
    sysid("sys.exit('sysid: no samples')")
    monkeypatch.setattr(demo, "record", lambda *_: None)
    assert demo.main(["--out", str(tmp_path / "out"), "--twin", str(CONFIG)]) == 1
    said = capfd.readouterr().err
    assert "sysid: no samples" in said
    assert said.endswith("demo: sysid diagnose ended with status 1; what it said stands above\n")


def test_a_diagnosis_that_is_not_installed_is_one_sentence(tmp_path) -> None:
    with pytest.raises(BadInputError, match="but it cannot be run: No such file"):
        demo.diagnose(tmp_path, tmp_path / "absent")


def test_a_folder_with_other_files_is_left_alone(tmp_path, capsys) -> None:
    (tmp_path / "thesis.pdf").write_text("precious")
    assert demo.main(["--out", str(tmp_path), "--twin", str(CONFIG)]) == 1
    assert "expected an empty folder or an earlier demo's" in capsys.readouterr().err
    assert (tmp_path / "thesis.pdf").read_text() == "precious"

"""A law with a formula becomes an effect file that every program can read."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pendulum_sysid.cli import main
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.effect_file import write_effect
from pendulum_sysid.verdict.record import EffectParameter, MeasuredLaw, RecordingFacts, Verdict

CUBE = MeasuredLaw(
    law="cart_force_by_position",
    place="cart",
    variables=("cart_position",),
    knots=(-0.3, 0.0, 0.3),
    values=(0.6, 0.0, -0.6),
    low=(0.5, -0.1, -0.7),
    high=(0.7, 0.1, -0.5),
    unit="N",
    formula="force on the cart in N = 0 - 22 x^3, x: cart position in m",
    sentence="The force on the cart grows with the cube of the cart position.",
    shape="cube",
    parameters={
        "offset": EffectParameter(0.0, -0.1, 0.1, "1"),
        "factor": EffectParameter(-22.0, -23.0, -21.0, "1"),
    },
)
WAVE = MeasuredLaw(
    **{
        **vars(CUBE),
        "law": "command_curve",
        "shape": "wave",
        "parameters": {
            name: EffectParameter(value, 0.0, 1.0, "1")
            for name, value in {"offset": 0.0, "sine": 0.1, "cosine": 0.2, "period": 0.5}.items()
        },
    }
)
ONE_WAY = MeasuredLaw(
    **{
        **vars(CUBE),
        "law": "cart_one_way_drag_along_rail",
        "shape": "step",
        "parameters": {
            name: EffectParameter(value, 0.0, 1.0, "1")
            for name, value in {"before": 1.0, "behind": -1.0, "place": 0.0, "width": 0.01}.items()
        },
    }
)
PROGRAM = """
import numpy as np
from pendulum_twin import Twin, simulate, load_twin
from pendulum_twin.effects import BY_NAME
twin = load_twin("config/inteco.yaml")
t = np.arange(0, 1, 0.01)
for name in ("learned_cube", "learned_one_way"):
    effect = BY_NAME[name]
    rich = Twin("rich", twin.rig, {name: {p.name: p.probes[0] for p in effect.parameters}})
    far = [simulate(w, t, 0 * t + 0.1, (0.3, 3.1, 0.0, 0.0)).cart[-1] for w in (twin, rich)]
    print(name, abs(far[0] - far[1]) > 1e-3, effect.place.value)
"""


@pytest.mark.parametrize(
    ("name", "at", "value"),
    [
        ("cart_dry_friction_along_rail", (0.1, 0.2), 1.5 - 2.0 * 0.2),
        ("cart_force_by_position", (0.2, 0.0, 0.0, 0.0), 1.5 - 2.0 * 0.2),
        ("cart_drag_along_rail", (0.2, 0.5, 0.0, 0.0), 2.0 * 0.2 * 0.5),
    ],
)
def test_a_learned_effect_acts_as_its_formula(name, at, value):
    """A drag leaves its mean to the viscous friction of the rig, and has no offset."""
    sizes = {"offset": 1.5, "slope": -2.0}
    parameters = {key: EffectParameter(size, size, size, "1") for key, size in sizes.items()}
    line = {**vars(CUBE), "law": name, "shape": "line", "parameters": parameters}
    scope: dict = {}
    exec(write_effect(MeasuredLaw(**line), "learned"), scope)
    effect = scope["EFFECT"]
    own = [sizes[parameter.name] for parameter in effect.parameters]
    assert effect.law(*at, *own) == pytest.approx(value)


def test_a_learned_bend_acts_as_two_lines():
    sizes = {"before": -2.0, "behind": 3.0, "offset": 0.5, "place": 0.1}
    parameters = {key: EffectParameter(size, size, size, "1") for key, size in sizes.items()}
    law = {**vars(CUBE), "law": "cart_force_by_position", "shape": "bend"}
    scope: dict = {}
    exec(write_effect(MeasuredLaw(**{**law, "parameters": parameters}), "learned"), scope)
    effect = scope["EFFECT"]
    own = [sizes[parameter.name] for parameter in effect.parameters]
    for at, value in ((0.1, 0.5), (-0.1, 0.9), (0.3, 1.1)):
        assert effect.law(at, 0.0, 0.0, 0.0, *own) == pytest.approx(value)


def test_a_learned_command_has_an_inverse():
    scope: dict = {}
    exec(write_effect(WAVE, "learned"), scope)
    effect, sizes = scope["EFFECT"], (0.02, 0.01, 0.5)
    assert [p.name for p in effect.parameters] == ["sine", "cosine", "period"]
    bent = effect.law(0.3, (), 0.001, 0.0, *sizes)
    assert bent != 0.3 and effect.law(0.3, (), 0.001, 0.0, 0.0, 0.0, 0.5) == 0.3
    assert effect.inverse(bent, 0.0, *sizes) == pytest.approx(0.3, abs=1e-6)


@pytest.mark.long
def test_learned_effects_run_in_a_twin(tmp_path):
    """Both at once: a twin's machine code is compiled anew for every set of effects."""
    for law, name in ((CUBE, "learned_cube"), (ONE_WAY, "learned_one_way")):
        (tmp_path / f"{name}.py").write_text(write_effect(law, name))
    told = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env={**os.environ, "PENDULUM_EFFECTS": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stdout.splitlines() == ["learned_cube True cart", "learned_one_way True cart"]


def test_a_curve_without_formula_stays_a_law():
    with pytest.raises(WrongUse, match="a curve without a formula"):
        write_effect(MeasuredLaw(**{**vars(CUBE), "shape": ""}), "learned")


def test_every_verb_knows_a_folder(tmp_path):
    (tmp_path / "learned.py").write_text(write_effect(CUBE, "learned"))
    told = subprocess.run(
        [sys.executable, "-m", "pendulum_sysid.cli", "effects", "--json", "--effects", tmp_path],
        capture_output=True,
        text=True,
        check=True,
    )
    assert '"learned"' in told.stdout


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "found none"), ("1 / 0", "ZeroDivisionError"), ("x = 1", "expected EFFECT")],
)
def test_a_folder_without_effects_is_refused_in_a_sentence(tmp_path, content, words):
    if content is not None:
        (tmp_path / "wrong.py").write_text(content)
    told = subprocess.run(
        [sys.executable, "-m", "pendulum_sysid.cli", "effects", "--effects", tmp_path],
        capture_output=True,
        text=True,
    )
    assert told.returncode == 2 and words in told.stderr and "Traceback" not in told.stderr


def write_verdict(folder: Path, *laws: MeasuredLaw) -> str:
    """Write a verdict with measured laws and return its folder."""
    facts = RecordingFacts("r", 1.0, 1, 1.0, "", 0.0, 0.0)
    verdict = Verdict(
        Outcome.NOT_IN_CATALOGUE, "", None, (), {}, (), None, None, (), None, facts, 1.0,
        measured_laws=laws,
    )  # fmt: skip
    (folder / "verdict.json").write_text(json.dumps(verdict.to_dict()))
    return str(folder)


def test_a_verdict_without_laws_teaches_nothing(tmp_path, capsys):
    assert main(["learn", write_verdict(tmp_path), "--out", str(tmp_path / "mine")]) == 1
    assert "expected measured laws, found none" in capsys.readouterr().err


def test_several_laws_do_not_share_a_name(tmp_path, capsys):
    """The file of the first law was overwritten without a word."""
    words = ["learn", write_verdict(tmp_path, CUBE, WAVE), "--out", str(tmp_path / "mine")]
    assert main([*words, "--name", "mine"]) == 2
    said = capsys.readouterr().err
    assert "has one law with a formula, found 2 (cart_force_by_position, command_curve)" in said
    assert "leave --name out" in said and not (tmp_path / "mine").exists()
    assert main(words) == 0
    names = {"learned_cart_force_by_position.py", "learned_command_curve.py"}
    assert {path.name for path in (tmp_path / "mine").iterdir()} == names


def test_a_name_is_for_the_law_that_has_a_formula(tmp_path, capsys):
    curve = MeasuredLaw(**{**vars(CUBE), "law": "pole_torque_by_angle", "shape": ""})
    verdict, out = write_verdict(tmp_path, curve, CUBE), tmp_path / "mine"
    assert main(["learn", verdict, "--out", str(out), "--name", "mine"]) == 0
    assert [path.name for path in out.iterdir()] == ["mine.py"]
    assert "a curve without a formula" in capsys.readouterr().err

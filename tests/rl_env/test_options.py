"""Command lines of `train` and `evaluate` that do not fit together are wrong use."""

from collections.abc import Callable

import pytest

from pendulum_rl_env.names import IN_PROCESS, OVER_TOPICS
from pendulum_rl_env.options import parse_evaluate_options, parse_train_options

TORQUE = "pendulum_rl_env/SamplePendulum-v0"
TRAIN, EVALUATE = ["--out", "run"], ["--policy", "policy.zip"]


@pytest.mark.parametrize(
    ("parse", "words", "said"),
    [
        (parse_train_options, ["--env", OVER_TOPICS], "give --rig NAMESPACE"),
        (parse_train_options, ["--rig", "rig", "--env", TORQUE], "expected no other task"),
        (parse_train_options, ["--rig", "rig", "--verdict", "v.json"], "--verdict: expected"),
        (parse_train_options, ["--env", TORQUE, "--twin", "t.yaml"], "--twin: expected the task"),
        (parse_train_options, ["--env", TORQUE, "--verdict", "v.json"], "--verdict: expected the"),
        (parse_train_options, ["--env", TORQUE, "--step-s", "0.02"], "--step-s: expected the"),
        (parse_train_options, ["--seed", "-1"], "expected a whole number from 0 to"),
        (parse_train_options, ["--seed", "99999999999"], "expected a whole number from 0 to"),
        (parse_train_options, ["--until", "nan"], "expected a number from"),
        (parse_train_options, ["--until", "inf"], "expected a number from"),
        (parse_evaluate_options, ["--rig", "rig", "--verdict", "v.json"], "--verdict: expected"),
        (parse_evaluate_options, ["--twin", "t.yaml", "--seed", "-1"], "expected a whole number"),
    ],
)
def test_what_does_not_fit_is_wrong_use(
    parse: Callable[[list[str]], object], words: list[str], said: str, capsys
) -> None:
    always = TRAIN if parse is parse_train_options else EVALUATE
    with pytest.raises(SystemExit, match="2"):
        parse([*always, *words])
    assert said in capsys.readouterr().err


def test_what_fits_is_taken() -> None:
    rig = parse_train_options([*TRAIN, "--env", OVER_TOPICS, "--rig", "rig", "--twin", "t.yaml"])
    assert (rig.rig, rig.env) == ("rig", OVER_TOPICS)
    twin = parse_train_options([*TRAIN, "--until", "400", "--seed", "4000000000"])
    assert (twin.until, twin.seed, twin.env) == (400.0, 4_000_000_000, IN_PROCESS)
    assert parse_evaluate_options([*EVALUATE, "--rig", "rig", "--seed", "3"]).seed == 3

"""Odd files end a command in a sentence; `python tests/fuzz/run.py` asks thousands."""

from hypothesis import HealthCheck, Phase, given, settings
from support.fuzzing import CASES, Case, list_faults, run_case


@settings(
    max_examples=100,
    deadline=None,
    database=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(CASES)
def test_a_command_ends_in_a_sentence(case: Case) -> None:
    assert list_faults(run_case(case)) == []

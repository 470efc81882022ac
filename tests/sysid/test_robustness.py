"""Faults of recording do not change the names, and are reported; all faults are in `support`."""

import pytest
from support.known_answers import ANSWERS, diagnose_once, list_mistakes

CHOSEN = ("stamp_wrongly", "begin_with_another_run")


@pytest.mark.parametrize("fault", CHOSEN)
def test_the_verdict_stays(fault: str) -> None:
    assert list_mistakes(ANSWERS[fault], diagnose_once(fault)) == []

"""Faults of recording do not change the names, and are reported; all faults are in `support`."""

import pytest
from support.known_answers import ANSWERS, diagnose_once, list_mistakes

CHOSEN = "begin_and_stamp_wrongly"  # two faults in one recording: neither hides the other


@pytest.mark.long
def test_the_verdict_stays() -> None:
    verdict = diagnose_once(CHOSEN)
    assert list_mistakes(ANSWERS[CHOSEN], verdict) == []
    assert {"stale", "jitter"} <= {finding.kind for finding in verdict.data_quality}

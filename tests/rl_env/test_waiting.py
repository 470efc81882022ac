"""A long start says a word, a short start says nothing."""

from threading import Event

import pytest

from pendulum_rl_env import waiting
from pendulum_rl_env.waiting import announce_compiling


def test_a_long_start_says_a_word(monkeypatch, capsys) -> None:
    said = Event()
    monkeypatch.setattr(waiting, "print", lambda *a, **k: said.set(), raising=False)
    with announce_compiling("train", patience_s=0.0):
        assert said.wait(30)


@pytest.mark.parametrize("fails", [False, True])
def test_a_short_start_says_nothing(fails, capsys) -> None:
    try:
        with announce_compiling("train", patience_s=3600.0):
            if fails:
                raise ValueError
    except ValueError:
        pass
    assert capsys.readouterr().err == ""

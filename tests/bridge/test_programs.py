"""Programs are started, watched and ended together, and what fails says so in a sentence."""

import sys

import pytest

from pendulum_bridge import programs
from pendulum_bridge.programs import Programs, wait_for, wait_until_done
from pendulum_twin.errors import BadInputError

LONG_S = 30.0


@pytest.fixture
def started(tmp_path, monkeypatch):
    """Return programs whose executables are scripts of Python text."""
    monkeypatch.setattr(programs, "SCRIPTS", tmp_path)

    def start(name: str, python: str, **options):
        script = tmp_path / name
        script.write_text(f"#!{sys.executable}\nimport os, signal, sys, threading\n{python}\n")
        script.chmod(0o755)
        return group.start(name, "one", 2, **options)

    with Programs(tmp_path / "logs", {"COLOUR": "blue"}) as group:
        yield group, start


WAITS = "print('ready', flush=True)\nthreading.Event().wait()"


def test_words_and_environment_arrive(started) -> None:
    group, start = started
    program = start("speaker", "print(sys.argv[1:], os.environ['COLOUR'], flush=True)")
    wait_until_done(program, group, LONG_S)
    assert program.said == "['one', '2'] blue\n"


def test_all_are_ended_the_last_one_first(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(programs, "SCRIPTS", tmp_path)
    log = tmp_path / "order"
    text = (
        "def end(*_):\n    open({log!r}, 'a').write(sys.argv[0][-1]); sys.exit(0)\n"
        "signal.signal(signal.SIGINT, end)\nprint('ready', flush=True)\nwhile True: signal.pause()"
    )
    for name in ("a", "b"):
        (tmp_path / name).write_text(
            f"#!{sys.executable}\nimport signal, sys\n{text.format(log=str(log))}\n"
        )
        (tmp_path / name).chmod(0o755)
    with pytest.raises(KeyboardInterrupt), Programs(tmp_path / "logs", {}) as group:
        both = [group.start(name) for name in ("a", "b")]
        for each in both:
            wait_for(each, "ready", LONG_S)
        raise KeyboardInterrupt
    assert log.read_text() == "ba" and [each.process.returncode for each in both] == [0, 0]


def test_one_that_will_not_end_is_killed(started, monkeypatch) -> None:
    _, start = started
    monkeypatch.setattr(programs, "ENDING_S", 0.2)
    deaf = start("deaf", "signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + WAITS)
    wait_for(deaf, "ready", LONG_S)
    programs.end(deaf)
    assert deaf.process.returncode == -9


def test_a_failure_is_told_by_its_last_words(started) -> None:
    group, start = started
    with pytest.raises(BadInputError, match=r"^broken ended with status 1: no rig$"):
        wait_for(start("broken", "sys.exit('first\\nno rig\\n')"), "ready", LONG_S)
    with pytest.raises(BadInputError, match=r"^broken ended with status 1"):
        wait_until_done(start("waiting", WAITS), group, LONG_S)


def test_waiting_has_an_end(started) -> None:
    group, start = started
    silent = start("silent", WAITS)
    with pytest.raises(
        BadInputError, match=r"silent: expected it to say 'serves' within 0.3 s: see .*silent.log"
    ):
        wait_for(silent, "serves", 0.3)
    with pytest.raises(BadInputError, match=r"silent: expected it to be done within 0.3 s"):
        wait_until_done(silent, group, 0.3)


def test_what_is_not_installed_is_a_sentence(started) -> None:
    group, _ = started
    with pytest.raises(
        BadInputError, match=r"expected the program .*absent, but it cannot be run: No such file"
    ):
        group.start("absent")

"""Programs are started, watched and ended together; a failure is told in a sentence."""

import sys

import pytest

from pendulum_bridge.studies import programs
from pendulum_bridge.studies.programs import Programs, wait_for, wait_until_done
from pendulum_twin.errors import WorkerError

LONG_S = 300.0  # never waited for: only a program that is stuck takes so long
WAITS = "print('ready', flush=True)\nthreading.Event().wait()"


@pytest.fixture
def group(tmp_path, monkeypatch):
    """Yield a group of programs whose executables are the scripts of `write_script`."""
    monkeypatch.setattr(programs, "SCRIPTS", tmp_path)
    with Programs(tmp_path / "logs", {"COLOUR": "blue"}) as started:
        yield started


@pytest.fixture
def write_script(tmp_path):
    def write(name: str, python: str) -> str:
        script = tmp_path / name
        script.write_text(f"#!{sys.executable}\nimport os, signal, sys, threading\n{python}\n")
        script.chmod(0o755)
        return name

    return write


def test_arguments_and_environment_arrive(group, write_script) -> None:
    script = write_script("speaker", "print(sys.argv[1:], os.environ['COLOUR'], flush=True)")
    program = group.start(script, "first", 2)
    wait_until_done(program, group, LONG_S)
    assert program.output == "['first', '2'] blue\n"


def test_all_are_ended_the_last_program_first(tmp_path, write_script, monkeypatch) -> None:
    monkeypatch.setattr(programs, "SCRIPTS", tmp_path)
    monkeypatch.setattr(programs, "GRACE_S", LONG_S)
    order = tmp_path / "order"
    text = (
        f"def end(*_):\n    open({str(order)!r}, 'a').write(sys.argv[0][-1]); sys.exit(0)\n"
        "signal.signal(signal.SIGINT, end)\nprint('ready', flush=True)\nwhile True: signal.pause()"
    )
    with pytest.raises(KeyboardInterrupt), Programs(tmp_path / "logs", {}) as group:
        started = [group.start(write_script(name, text)) for name in ("a", "b")]
        for program in started:
            wait_for(program, "ready", LONG_S)
        raise KeyboardInterrupt
    assert order.read_text() == "ba"
    assert [program.process.returncode for program in started] == [0, 0]


def test_a_program_that_ignores_sigint_is_killed(group, write_script, monkeypatch) -> None:
    monkeypatch.setattr(programs, "GRACE_S", 0.2)
    script = write_script("deaf", "signal.signal(signal.SIGINT, signal.SIG_IGN)\n" + WAITS)
    deaf = group.start(script)
    wait_for(deaf, "ready", LONG_S)
    programs.end_program(deaf)
    assert deaf.process.returncode == -9


def test_a_failure_is_told_by_its_last_line(group, write_script) -> None:
    broken = group.start(write_script("broken", "sys.exit('first\\nno rig\\n')"))
    with pytest.raises(WorkerError, match=r"^broken ended with status 1: no rig$"):
        wait_for(broken, "ready", LONG_S)
    waiting = group.start(write_script("waiting", WAITS))
    with pytest.raises(WorkerError, match=r"^broken ended with status 1"):
        wait_until_done(waiting, group, LONG_S)


def test_waiting_has_an_end(group, write_script) -> None:
    silent = group.start(write_script("silent", WAITS))
    with pytest.raises(
        WorkerError, match=r"silent: expected it to say 'serves' within 0.3 s: see .*silent.log"
    ):
        wait_for(silent, "serves", 0.3)
    with pytest.raises(WorkerError, match=r"silent: expected it to be done within 0.3 s"):
        wait_until_done(silent, group, 0.3)


def test_a_program_that_is_not_installed_is_told_in_a_sentence(group) -> None:
    with pytest.raises(
        WorkerError, match=r"expected the program .*absent, but it cannot be run: No such file"
    ):
        group.start("absent")

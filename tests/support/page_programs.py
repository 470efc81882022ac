"""Programs in place of recorder and `sysid` for the page: quick, and as slow as a test wants."""

import os
import sys
from pathlib import Path

from pendulum_bridge.view.recordings import Programs

READY = "recording to "
# It writes a file where a recorder would write a bag, and ends on SIGINT, which is blocked before
# it says that it is ready: a signal between that line and the wait is kept for the wait.
RECORD = """
import pathlib, signal, sys
folder = pathlib.Path(sys.argv[1]); folder.mkdir(parents=True)
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
print("recording to", folder, flush=True)
signal.sigwait({signal.SIGINT})
(folder / "bag").write_text("whole")
"""
# It says how far it is, waits for a file `go` beside the recordings, and writes a verdict with a
# report that tries to press the page's stop. It polls by itself, with a deadline: a program apart
# imports nothing of the tests.
DIAGNOSE = """
import json, os, pathlib, sys, time
end = time.monotonic() + 240.0
recording, out = map(pathlib.Path, sys.argv[1:])
assert (recording / "bag").read_text() == "whole"
print(" 40 %, about 25 s left: growing the set", file=sys.stderr, flush=True)
while not (recording.parents[1] / "go").exists():
    assert time.monotonic() < end
    time.sleep(0.01)
out.mkdir()
verdict = {"outcome": "named", "sentence": f"Dry friction <b>holds</b>, nice {os.nice(0)}."}
(out / "verdict.json").write_text(json.dumps(verdict))
press = "fetch('/stop', {method: 'POST'}).then(answer => answer.text(), String)"
script = press + ".then(text => { document.title = text; })"
(out / "report.html").write_text(f"<h1>The report</h1><script>{script}</script>")
"""


def make_fake_programs(record: str = RECORD, diagnose: str | None = DIAGNOSE) -> Programs:
    """Return programs that run the two texts of Python."""
    return Programs(
        lambda folder: [sys.executable, "-c", record, str(folder)],
        READY,
        (lambda recording, out: [sys.executable, "-c", diagnose, str(recording), str(out)])
        if diagnose
        else None,
        dict(os.environ),
    )


def let_diagnoses_end(folder: Path) -> None:
    """Let the diagnoses of recordings below a folder end."""
    (folder / "go").touch()

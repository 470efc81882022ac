"""What a diagnosis imports before it begins."""

import subprocess
import sys


def test_a_diagnosis_begins_without_what_it_seldom_needs() -> None:
    """scipy.stats, plots and the proof's rivals take half of the time that imports take."""
    code = "import sys, pendulum_sysid.pipeline; print(*sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "numba" in ran.stdout.split()
    assert not {"scipy.stats", "matplotlib", "torch", "pandas"} & set(ran.stdout.split())

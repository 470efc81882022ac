"""Measured laws of made recordings, beside the constants of the rig alone."""

from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.measuring.measure import Measured, begin_without_laws, measure_laws
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_twin.model import Twin


def measure_beside_constants(recordings: list[Recording], twin: Twin) -> Measured:
    """Return the laws that recordings show beside the constants of a twin; fail for no law."""
    prepared = prepare(recordings, twin)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    measured = measure_laws(case, split, begun, lambda line: None)
    assert measured is not None
    return measured

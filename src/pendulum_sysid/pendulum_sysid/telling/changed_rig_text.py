"""Say how a rig changed between its recordings, and which load would change it so."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.changed_rig import ChangedRig, SizeByPart
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.telling.contradictions import LEAST_LOG
from pendulum_twin.model import Twin


def describe_change(change: ChangedRig, twin: Twin) -> str:
    """Return the sentences on a rig that changed between its recordings; twin: as given."""
    recordings = " and ".join(_name_part(part) for part in change.parts)
    listed = change.changed[: decisions.CHANGED_VALUES_LISTED]
    more = len(change.changed) - len(listed)
    values = "; ".join(_describe_size(size) for size in listed)
    return (
        "The rig changed between the recordings: each by itself ends at "
        f"{change.misfit:.3g} times the noise at most, all together at {change.together:.3g} "
        f"times. In {recordings}: {values}{f'; and {more} more' if more else ''}."
        f"{_describe_load(change, twin)} Diagnose each recording by itself."
    )


def _name_part(part: range) -> str:
    single = len(part) == 1
    return f"recording {part[0]}" if single else f"recordings {part[0]} to {part[-1]}"


def _describe_size(size: SizeByPart) -> str:
    values = " and ".join(
        f"{e.value:.4g} [{e.low:.4g}, {e.high:.4g}]" if e.identifiable else "not fixed"
        for e in size.estimates
    )
    return f"{size.name} {values} {size.unit}"


def _describe_load(change: ChangedRig, twin: Twin) -> str:
    """Return the sentence on the load by which all constants change; empty for another change.

    Motion fixes only ratios to the moving mass. A constant that is held or believed does not
    change as the others do, so that nothing says whether all of them would.
    """
    constants = {constant.name for constant in list_rig_parameters(twin)}
    factor = None if twin.spreads else find_change_of_mass(change, constants)
    if factor is None or twin.rig.cart_mass_kg is None:
        return ""
    load = twin.rig.total_mass_kg * (factor - 1.0)
    done = "put on" if load > 0.0 else "taken off"
    return (
        " All constants change by the same factor, as they do where a load of "
        f"{abs(load):.2g} kg is {done} the cart."
    )


def find_change_of_mass(change: ChangedRig, constants: Collection[str]) -> float | None:
    """Return the factor by which the moving mass changes from the first to the last recording.

    None where the constants change by different factors, where the factor is near 1, and where a
    part does not fix a constant.
    """
    of_rig = [size for size in change.sizes if size.name in constants]
    ends = [(size.estimates[0], size.estimates[-1]) for size in of_rig]
    if not all(e.identifiable and e.low > 0.0 for pair in ends for e in pair):
        return None
    logs = np.log([[(e.value, e.low, e.high) for e in pair] for pair in ends])
    ratios = logs[:, 0, 0] - logs[:, 1, 0]
    halves = 0.5 * np.hypot(*(logs[:, :, 2] - logs[:, :, 1]).T) / decisions.INTERVAL_DEVIATIONS
    common = float(np.average(ratios, weights=halves**-2))
    is_common = np.all(abs(ratios - common) <= decisions.CONTRADICTED_DEVIATIONS * halves)
    return float(np.exp(common)) if is_common and abs(common) > LEAST_LOG else None

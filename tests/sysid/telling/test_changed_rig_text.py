"""The sentence on the load by which a rig changed between its recordings, and where it is none."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO

from pendulum_sysid.finding.changed_rig import ChangedRig, SizeByPart
from pendulum_sysid.fitting.parameters import hold_constants, list_rig_parameters
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.changed_rig_text import describe_change
from pendulum_twin.model import Twin

CONSTANTS = [constant.name for constant in list_rig_parameters(INTECO)]
FORCE = "force_per_pwm_n"
SAME = (1.0, 1.0)


def make_change(factors: dict[str, tuple[float, ...]]) -> ChangedRig:
    """Return a change of sizes about 2, known to 1 %, by these factors a part."""
    sizes = tuple(
        SizeByPart(name, "N", 2.0, tuple(Estimate(2 * f, 1.98 * f, 2.02 * f) for f in by_part))
        for name, by_part in factors.items()
    )
    parts = (range(1, 2), range(2, 4), range(4, 5))[: len(sizes[0].estimates)]
    return ChangedRig(parts, (), 0.9, 8.0, sizes)


def test_constants_that_change_by_one_factor_are_a_load() -> None:
    sentence = describe_change(make_change({name: (1.0, 0.8) for name in CONSTANTS}), INTECO)
    assert "In recording 1 and recordings 2 to 3: " in sentence
    load = 0.25 * INTECO.rig.total_mass_kg
    assert f"a load of {load:.2g} kg is put on the cart" in sentence


@pytest.mark.parametrize(
    "factors",
    [
        {**dict.fromkeys(CONSTANTS, SAME), "cart_coulomb_friction.level_n": (1.0, 1.5)},
        {name: (1.0, 0.8, 1.0) for name in CONSTANTS},
    ],
    ids=["an effect alone changes", "a load is on and off again"],
)
def test_constants_that_are_the_same_at_both_ends_are_no_load(
    factors: dict[str, tuple[float, ...]],
) -> None:
    sentence = describe_change(make_change(factors), INTECO)
    assert "The rig changed" in sentence and "load of" not in sentence


@pytest.mark.parametrize(
    ("twin", "factors"),
    [
        (hold_constants(INTECO, ("all",)), {"cart_coulomb_friction.level_n": (1.0, 1.5)}),
        (hold_constants(INTECO, [n for n in CONSTANTS if n != FORCE]), {FORCE: (1.0, 0.9)}),
        (replace(INTECO, spreads={FORCE: 0.1}), {name: (1.0, 0.8) for name in CONSTANTS}),
    ],
    ids=["no constant is free", "a single constant is free", "a constant is believed"],
)
def test_constants_that_are_believed_or_held_tell_no_load(
    twin: Twin, factors: dict[str, tuple[float, ...]]
) -> None:
    assert "load of" not in describe_change(make_change(factors), twin)

"""The rig of table 1, and the same with a rail so long that nothing ends."""

from dataclasses import replace

import pytest
from support.paths import CONFIG

from pendulum_twin.model import load_twin
from pendulum_twin.rig import Rig


@pytest.fixture(scope="session")
def nominal() -> Rig:
    return load_twin(CONFIG / "inteco.yaml").rig


@pytest.fixture(scope="session")
def endless(nominal: Rig) -> Rig:
    return replace(nominal, rail_half_length_m=1000.0)

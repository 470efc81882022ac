"""Hold how finely a rig measures: the steps of its encoders."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_twin.rig import check_number


@dataclass(frozen=True)
class Encoders:
    """Hold the steps of the encoders.

    position_step_m: m; 0 for exact positions.
    angle_step_rad: rad; 0 for exact angles.

    With both 0 the velocities are exact, too. Otherwise reported velocities are differences of two
    reported positions over the time between them. Raises BadInputError for a step below 0 or too
    coarse for an encoder.
    """

    position_step_m: float = 0.0
    angle_step_rad: float = 0.0

    def __post_init__(self) -> None:
        check_number("position_step_m", self.position_step_m, 0.0, 0.1)
        check_number("angle_step_rad", self.angle_step_rad, 0.0, 1.0)

    @property
    def steps(self) -> tuple[float, float]:
        """Return the steps of position (m) and angle (rad)."""
        return self.position_step_m, self.angle_step_rad


EXACT = Encoders()

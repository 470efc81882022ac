"""The rig's wire protocol: a packet a command, a packet a sample, all numbers big-endian doubles.

Source: the thesis's client library, masks `>dd` and `>dddd`, which is what a rig built for it
sends and expects.
"""

from __future__ import annotations

import math
import struct
from dataclasses import astuple, dataclass

from pendulum_twin.errors import BadInputError

COMMAND, SAMPLE = struct.Struct(">dd"), struct.Struct(">dddd")


@dataclass(frozen=True)
class Command:
    """Hold a command to the rig.

    pwm: PWM fraction; a positive command pushes the cart the positive way; the rig clips it.
    reset: whether the swing-down is requested; the rig starts it at a change from False to True.

    Raises BadInputError when pwm is not finite.
    """

    pwm: float
    reset: bool = False

    def __post_init__(self) -> None:
        _check_finite("command", (self.pwm,))

    def pack(self) -> bytes:
        """Return the command's 16 bytes: the PWM fraction, then 1 or 0 for reset."""
        return COMMAND.pack(self.pwm, float(self.reset))

    @staticmethod
    def unpack(packet: bytes) -> Command:
        """Return the command of a packet.

        Raises BadInputError for a wrong length, NaN, infinity, or a flag other than 0 and 1.
        """
        pwm, flag = _unpack_numbers("command", COMMAND, packet)
        if flag not in (0.0, 1.0):
            raise BadInputError(f"command: expected the reset flag to be 0 or 1, found {flag:g}")
        return Command(pwm, flag == 1.0)


@dataclass(frozen=True)
class Sample:
    """Hold a sample of the rig.

    pole_rad: rad; 0 upright, counterclockwise positive, pi hanging, not wrapped.
    pole_rate: rad/s.
    cart_m: m; 0 in the middle of the rail, positive along the rail.
    cart_velocity: m/s.

    Raises BadInputError when a field is not finite.
    """

    pole_rad: float
    pole_rate: float
    cart_m: float
    cart_velocity: float

    def __post_init__(self) -> None:
        _check_finite("sample", astuple(self))

    def pack(self) -> bytes:
        """Return the sample's 32 bytes, in the order of the fields."""
        return SAMPLE.pack(self.pole_rad, self.pole_rate, self.cart_m, self.cart_velocity)

    @staticmethod
    def unpack(packet: bytes) -> Sample:
        """Return the sample of a packet.

        Raises BadInputError for a wrong length, NaN or infinity.
        """
        return Sample(*_unpack_numbers("sample", SAMPLE, packet))


def _unpack_numbers(name: str, layout: struct.Struct, packet: bytes) -> tuple[float, ...]:
    if len(packet) != layout.size:
        raise BadInputError(
            f"{name}: expected a packet of {layout.size} bytes, found {len(packet)}"
        )
    numbers = layout.unpack(packet)
    _check_finite(name, numbers)
    return numbers


def _check_finite(name: str, numbers: tuple[float, ...]) -> None:
    for number in numbers:
        if not math.isfinite(number):
            raise BadInputError(f"{name}: expected finite numbers, found {number}")

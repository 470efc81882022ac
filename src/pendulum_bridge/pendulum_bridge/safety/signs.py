"""The signs of a rig's command and encoders, as the rail guard and the reset need them."""

from __future__ import annotations

from collections.abc import Collection


def find_ways(effects: Collection[str]) -> tuple[int, int]:
    """Return way and pole_way (see `RailGuard`) of a rig with these effects.

    effects: names in the twin file.
    """
    command, cart, pole = (
        -1 if name in effects else 1
        for name in ("input_sign_inverted", "cart_sign_inverted", "angle_sign_inverted")
    )
    return command * cart, cart * pole

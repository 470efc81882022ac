"""The kind of each trial, with the shares of the kinds as even as possible in every run."""

from __future__ import annotations

from collections.abc import Mapping

from pendulum_twin.errors import BadInputError
from pendulum_twin.suggest import add_hint

EFFECTS_OF_KIND = {
    "nothing": 0,
    "single": 1,
    "pair": 2,
    "triple": 3,
    "quadruple": 4,
    "unlisted": 0,
}
USUAL_SHARES = {"nothing": 15, "single": 40, "pair": 20, "triple": 10, "unlisted": 15}


def parse_shares(text: str) -> dict[str, int]:
    """Return kind -> share of a text such as `nothing:15,single:40`.

    Raises BadInputError when a kind is unknown or double, or when no share is positive.
    """
    shares: dict[str, int] = {}
    for entry in text.split(","):
        kind, _, share = entry.strip().partition(":")
        if (
            kind not in EFFECTS_OF_KIND
            or kind in shares
            or not (share.isascii() and share.isdigit())
        ):
            hint = "" if kind in EFFECTS_OF_KIND else add_hint(kind, EFFECTS_OF_KIND)
            raise BadInputError(
                "expected KIND:SHARE,... with whole shares and the kinds "
                f"{', '.join(EFFECTS_OF_KIND)}, found {entry!r}{hint}"
            )
        shares[kind] = int(share)
    if not sum(shares.values()):
        raise BadInputError(f"expected a share above 0, found {text!r}")
    return shares


def find_kind(number: int, shares: Mapping[str, int]) -> tuple[str, int]:
    """Return the kind of a trial, and how many trials of its kind come before it.

    A trial has the kind that lags most behind its share; among equals, the first kind.
    number: of the trial, from 0.
    shares: kind -> share.
    """
    total = sum(shares.values())
    counts = dict.fromkeys(shares, 0)
    for k in range(number + 1):
        kind = max(shares, key=lambda name: shares[name] * (k + 1) - counts[name] * total)
        counts[kind] += 1
    return kind, counts[kind] - 1

"""Which kind of trial comes when: the shares as even as they can be over any stretch, and the same whatever is asked for."""

from __future__ import annotations

from collections.abc import Mapping

from pendulum_twin.errors import BadInputError

EFFECTS_OF_KIND = {"nothing": 0, "single": 1, "pair": 2, "triple": 3, "unlisted": 0}
USUAL_SHARES = {"nothing": 15, "single": 40, "pair": 20, "triple": 10, "unlisted": 15}


def parse_shares(text: str) -> dict[str, int]:
    """Return kind -> share as `nothing:15,single:40` has them; raise BadInputError for what cannot be shared out."""
    shares: dict[str, int] = {}
    for part in text.split(","):
        kind, _, share = part.strip().partition(":")
        if (
            kind not in EFFECTS_OF_KIND
            or kind in shares
            or not (share.isascii() and share.isdigit())
        ):
            raise BadInputError(
                f"--kinds: expected KIND:SHARE,... with whole shares and the kinds {', '.join(EFFECTS_OF_KIND)}, found {part!r}"
            )
        shares[kind] = int(share)
    if not sum(shares.values()):
        raise BadInputError(f"--kinds: expected a share above 0, found {text!r}")
    return shares


def find_kind(number: int, shares: Mapping[str, int]) -> tuple[str, int]:
    """Return the kind of this trial, and how many of its kind stand before it.

    Every trial is of the kind that lags most behind its share; of equals, the first.
    """
    total = sum(shares.values())
    counts = dict.fromkeys(shares, 0)
    for k in range(number + 1):
        kind = max(shares, key=lambda each: shares[each] * (k + 1) - counts[each] * total)
        counts[kind] += 1
    return kind, counts[kind] - 1

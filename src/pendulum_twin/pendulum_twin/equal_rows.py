"""Groups of equal rows: twins that share a command, a drive or a path are computed once."""

import numpy as np

from pendulum_twin.arrays import Floats, Ints


def group_equal_rows(table: Floats) -> tuple[Ints, Ints]:
    """Return the first row of each group of equal rows, (groups,), and each row's group, (rows,).

    Groups stand in the order of their first rows. Rows are looked up by their bytes, which took
    0.05 to 0.2 of the time of `numpy.unique`, which sorts (30 to 120 rows, 20 to 300 columns).
    """
    groups: dict[bytes, int] = {}
    first: list[int] = []
    group_of = np.empty(len(table), dtype=np.int64)
    for k, row in enumerate(np.ascontiguousarray(table + 0.0)):  # -0.0 becomes 0.0
        group = groups.setdefault(row.tobytes(), len(groups))
        if group == len(first):
            first.append(k)
        group_of[k] = group
    return np.array(first, dtype=np.int64), group_of

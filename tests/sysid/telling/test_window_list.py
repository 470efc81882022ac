"""The windows that a report lists and opens with are those with the largest errors."""

import numpy as np
import pytest

from pendulum_sysid.telling.window_list import (
    HELD_OUT,
    MOST_LISTED,
    WindowRow,
    find_worst,
    list_largest,
)


def list_rows(errors: np.ndarray) -> list[WindowRow]:
    """Return held-out windows with these errors (windows, channels) after."""
    return [
        WindowRow(k + 1, HELD_OUT, float(k), k + 1.0, tuple(row), tuple(row), k)
        for k, row in enumerate(errors.tolist())
    ]


@pytest.mark.parametrize("diverged", [np.nan, np.inf])
def test_a_run_that_diverged_is_listed_and_hides_no_large_error(diverged: float) -> None:
    """The median of errors with a NaN is NaN, and all windows ranked alike."""
    errors = np.full((MOST_LISTED + 50, 2), 1.0) * [1e-3, 1e-2]
    errors[-1, 0] = diverged
    errors[-2, 1] = 0.5
    rows = list_rows(errors)
    numbers = [row.number for row in list_largest(rows)]
    assert len(numbers) == MOST_LISTED and numbers == sorted(numbers)
    assert numbers[-2:] == [len(rows) - 1, len(rows)]
    worst = find_worst(rows)
    assert worst is not None and worst.number == len(rows)


def test_windows_compare_where_most_runs_diverged() -> None:
    """The median of such errors was infinite, and any of them was the worst."""
    errors = np.array([[np.inf, 1.0], [np.nan, 1.0], [2e-3, 1.0], [1e-3, 9.0]])
    assert [row.number for row in list_largest(list_rows(errors))] == [1, 2, 3, 4]
    worst = find_worst(list_rows(errors[2:]))
    assert worst is not None and worst.number == 2
    diverged = find_worst(list_rows(errors[[2, 3, 0, 1]]))
    assert diverged is not None and diverged.number == 3


def test_no_window_is_listed_where_none_is_there() -> None:
    assert list_largest([]) == [] and find_worst([]) is None

"""Rows are grouped as numpy groups them, in the order in which they come."""

import numpy as np

from pendulum_twin.equal_rows import group_equal_rows


def test_groups_are_those_of_numpy() -> None:
    table = np.random.default_rng(0).integers(0, 3, (60, 3)).astype(float)
    first, group_of = group_equal_rows(table)
    distinct = np.unique(table, axis=0)
    assert len(first) == len(distinct) and (np.diff(first) > 0).all()
    np.testing.assert_array_equal(table[first][group_of], table)
    assert group_of.max() == len(first) - 1


def test_zeros_of_either_sign_are_equal() -> None:
    first, group_of = group_equal_rows(np.array([[0.0, 1.0], [-0.0, 1.0], [0.0, 2.0]]))
    assert first.tolist() == [0, 2] and group_of.tolist() == [0, 0, 1]


def test_no_rows_have_no_groups() -> None:
    first, group_of = group_equal_rows(np.empty((0, 4)))
    assert len(first) == len(group_of) == 0

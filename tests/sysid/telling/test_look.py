"""Pictures share their colours, and leave out what cannot be drawn."""

import numpy as np
from matplotlib.colors import to_hex
from support.drawn_verdicts import make_named

from pendulum_sysid.telling.compare_plot import STYLES
from pendulum_sysid.verdict.look import (
    ACCENT,
    INK,
    keep_drawable,
    keep_drawable_on_log_scale,
)


def test_values_that_cannot_be_drawn_are_left_out() -> None:
    values = np.array([-1.0, 0.0, 2.0, 1e20, 1e31, np.inf, -np.inf, np.nan])
    none = np.nan
    np.testing.assert_array_equal(
        keep_drawable(values), [-1.0, 0.0, 2.0, 1e20, none, none, none, none]
    )
    np.testing.assert_array_equal(
        keep_drawable_on_log_scale(values), [none, none, 2.0, none, none, none, none, none]
    )


def test_before_and_after_have_the_colours_of_the_report() -> None:
    """One was black in two pictures, and ink in the report."""
    assert [style["color"] for style in STYLES] == [INK, ACCENT]
    lines = make_named().plot().axes[0].get_lines()
    assert [to_hex(line.get_color()) for line in lines[1:]] == [INK, ACCENT]

"""Pictures share their colours, and leave out what cannot be drawn."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from support.drawn_verdicts import make_named

from pendulum_sysid.telling.compare_plot import STYLES
from pendulum_sysid.verdict.look import (
    ACCENT,
    INK,
    keep_drawable,
    keep_drawable_on_log_scale,
)
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.errors import BadInputError


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


def test_a_run_that_is_far_off_leaves_the_measured_run_its_room() -> None:
    verdict = make_named()
    first = verdict.overlays[0]
    far = replace(first, before=first.before + 1e3)
    axes = replace(verdict, overlays=(far,)).plot().axes[0]
    low, high = np.min(first.measured[0]), np.max(first.measured[0])
    room = 0.5 * (high - low)
    assert axes.get_ylim() == pytest.approx((low - room, high + room))


def test_a_value_has_the_digits_that_its_interval_is_worth() -> None:
    """Two more than are sure: a half width of 0.01 of 0.46 is worth four."""
    html = make_named()._repr_html_()
    assert "level_n: 0.4612 [0.4508, 0.4716] N" in html
    assert "n_m_s2: 1.31e-05 [1.12e-05, 1.5e-05] N m s^2" in html


@pytest.mark.parametrize("wrong", [True, 3.0, "3", None])
def test_a_count_in_a_file_is_a_whole_number(wrong: object) -> None:
    content = make_named().to_dict()
    content["data_quality"][0]["count"] = wrong
    with pytest.raises(BadInputError, match=r"data_quality\[0\]\.count: expected int, found"):
        Verdict.from_dict(content)

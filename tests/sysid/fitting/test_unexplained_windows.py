"""What neither the twin nor the recorded commands explain is left out, and said."""

from dataclasses import replace

import numpy as np
from support.doubtful_commands import COUNT, HELD, record_answers
from support.made_recordings import INTECO, PERIOD_S, made

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting.unexplained_windows import leave_out_unexplained
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta

T = PERIOD_S * np.arange(COUNT)
TRUE = make_theta(HELD)


def prepare_pushed(begin_s: float, stop_s: float):
    """Return a case in which something pushes the cart with a fifth of the drive's force."""
    push = np.where((begin_s < T) & (stop_s > T), 0.1, 0.0)
    raw, _ = record_answers(HELD, push)
    return prepare_case([clean_recording(raw)], HELD)


def test_a_short_push_is_left_out() -> None:
    case = prepare_pushed(12.2, 12.5)
    kept = leave_out_unexplained(case, TRUE)
    finding = kept.recording.findings[-1]
    ((first, stop),) = finding.intervals_s
    print(f"left out {first:.2f} to {stop:.2f} s: {finding.note}")
    assert finding.kind == "gap" and first < 12.2 and 12.5 < stop < first + 2.1
    out = ~kept.signals.cart_valid
    assert np.array_equal(out, ~kept.signals.pole_valid)
    assert T[: len(out)][out].min() < 12.2 and out.sum() == round((stop - first) / PERIOD_S)
    assert leave_out_unexplained(kept, TRUE) is kept


def test_what_acts_for_long_stays() -> None:
    case = prepare_pushed(5.0, 15.0)
    assert leave_out_unexplained(case, TRUE) is case


def test_a_twin_that_lacks_physics_leaves_nothing_out() -> None:
    raw, _ = record_answers(HELD)
    case = prepare_case([clean_recording(raw)], INTECO)
    assert leave_out_unexplained(case, make_theta(INTECO)) is case


def test_a_recording_whose_commands_are_sure_stays_as_it_is() -> None:
    case = prepare_case([made(INTECO)], INTECO)
    cart = case.signals.cart.copy()
    cart[500:520] += 0.01
    moved = replace(
        case, recording=replace(case.recording, signals=replace(case.signals, cart=cart))
    )
    assert leave_out_unexplained(moved, make_theta(INTECO)) is moved

"""What is sent: the stop overrides the watchdog, that the rail guard, and that the limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.guarded_rigs import PERIOD_S, seen, settled, stepper

from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.events import (
    activate,
    begin_reset,
    clear_stop,
    deactivate,
    fail_safe,
    hear_writer,
    press_stop,
    take_command,
)
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Rules, make_rules, make_safety
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

MIDDLE = RigState(0.0, math.pi, 0.0, 0.0)
AT_THE_END = RigState(0.83, math.pi, 1.0, 0.0)


@pytest.fixture(scope="module")
def rules(nominal: Rig) -> Rules:
    return make_rules(nominal, Limits(0.5, 10.0))


def test_a_good_command_is_sent_as_it_is(rules: Rules) -> None:
    decision = decide(0.05, MIDDLE, 0.01, settled(rules, MIDDLE), rules)
    assert decision.pwm == 0.05 and decision.reasons == () and decision.level is Level.OK


def test_before_anything_is_heard_nothing_is_sent(rules: Rules) -> None:
    decision = decide(0.3, None, 0.01, make_safety(0.0), rules)
    assert decision.pwm == 0.0 and decision.reasons == (Reason.NO_SAMPLE_YET,)
    assert (
        decide(None, MIDDLE, 0.02, decision.safety, rules).pwm > 0.0
    )  # the command is fresh still


def test_all_at_once_the_first_in_order_wins(rules: Rules) -> None:
    """Take one cause away after the other: stop, silence, old command, end of the rail, limits."""
    safety = decide(9.0, AT_THE_END, 0.01, settled(rules, AT_THE_END), rules).safety
    latched, _ = press_stop(safety)
    assert decide(9.0, None, 1.0, latched, rules).reasons[0] is Reason.STOPPED
    assert decide(9.0, None, 1.0, safety, rules).reasons[0] is Reason.RIG_SILENT
    assert decide(None, AT_THE_END, 1.0, safety, rules).reasons[0] is Reason.COMMAND_OLD
    braked = decide(9.0, AT_THE_END, 0.02, safety, rules)
    assert (
        braked.reasons == (Reason.RAIL_BRAKING, Reason.OVER_LIMIT, Reason.TOO_FAST)
        and braked.pwm == -0.5
    )
    limited = decide(9.0, MIDDLE, 0.02, settled(rules, MIDDLE), rules)
    assert limited.reasons == (
        Reason.OVER_LIMIT,
        Reason.TOO_FAST,
    ) and limited.pwm == pytest.approx(0.2)


def test_a_silent_rig_and_an_old_command_are_errors_with_pwm_0_in_time(rules: Rules) -> None:
    for come, reason in ((None, Reason.RIG_SILENT), (MIDDLE, Reason.COMMAND_OLD)):
        safety, now = decide(0.1, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety, 0.01
        command = None if come else 0.1
        while (decision := decide(command, come, now := now + PERIOD_S, safety, rules)).pwm:
            safety = decision.safety
        assert now == pytest.approx(0.01 + 0.2, abs=1.5 * PERIOD_S)
        assert decision.reasons == (reason,) and decision.level is Level.ERROR


def test_bad_commands_and_samples_are_counted_and_change_nothing(rules: Rules) -> None:
    safety = decide(0.1, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety
    decision = decide(math.nan, RigState(math.nan, 0.0, 0.0, 0.0), 0.02, safety, rules)
    assert decision.pwm == pytest.approx(0.1)
    assert decision.reasons == (Reason.COMMAND_NOT_FINITE, Reason.SAMPLE_NOT_FINITE)
    assert (decision.safety.counts.commands, decision.safety.counts.samples) == (1, 1)
    safety = decision.safety
    for k in range(30):
        safety = decide(math.inf, MIDDLE, 0.03 + k * PERIOD_S, safety, rules).safety
    assert (
        safety.applied == 0.0 and safety.counts.commands == 31
    )  # refused commands feed no watchdog


@pytest.mark.parametrize("absurd", [1e9, -1e200, 1.7e308, -math.inf])
@pytest.mark.parametrize("field", ["cart_m", "pole_rad", "cart_m_s", "pole_rad_s"])
def test_an_absurd_number_in_a_sample_is_refused_like_nan_and_fails_nothing(
    rules: Rules, field: str, absurd: float
) -> None:
    safety = decide(0.1, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety
    for k in range(10):
        decision = decide(
            None, replace(MIDDLE, **{field: absurd}), 0.02 + k * PERIOD_S, safety, rules
        )
        safety = decision.safety
    assert safety.counts.samples == 10 and safety.rig == MIDDLE
    assert Reason.SAMPLE_NOT_FINITE in decision.reasons and not safety.encoders.fault


def test_commands_during_a_stop_are_dropped_and_not_sent_after_it(rules: Rules) -> None:
    safety, _ = press_stop(decide(0.3, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety)
    for command, answer in ((0.3, Reason.ZERO_FIRST), (0.0, Reason.STOP_CLEARED)):
        decision = decide(command, MIDDLE, 0.02, safety, rules)
        assert decision.pwm == 0.0 and decision.reasons == (Reason.STOPPED, Reason.DROPPED)
        safety, found = clear_stop(decision.safety, rules)
        assert found is answer
    quiet = decide(None, MIDDLE, 0.03, safety, rules)
    assert quiet.pwm == 0.0 and quiet.reasons == (Reason.NO_COMMAND_YET,)
    assert decide(0.05, MIDDLE, 0.04, quiet.safety, rules).pwm == 0.05


def test_the_stop_ends_a_reset_for_good(rules: Rules) -> None:
    swinging = RigState(0.2, 2.0, 0.0, 5.0)
    safety, reason = begin_reset(0.0, settled(rules, swinging), rules)
    assert reason is Reason.RESETTING
    moving = decide(0.3, swinging, 0.01, safety, rules)
    assert (
        moving.pwm != 0.0 and Reason.RESETTING in moving.reasons
    )  # its own command; the other is dropped
    assert moving.safety.counts.during_reset == 1
    safety, ended = press_stop(moving.safety)
    assert ended is Reason.RESET_STOPPED
    assert decide(None, swinging, 0.02, safety, rules).pwm == 0.0
    assert begin_reset(0.02, safety, rules)[1] is Reason.RESET_STOPPED
    safety, _ = clear_stop(take_command(0.0, safety)[0], rules)
    after = decide(None, swinging, 0.03, safety, rules)
    assert after.pwm == 0.0 and after.reset_ended is None


def test_a_rig_that_falls_silent_ends_a_reset(rules: Rules) -> None:
    swinging = RigState(0.2, 2.0, 0.0, 5.0)
    assert begin_reset(0.0, make_safety(0.0), rules)[1] is Reason.RESET_SILENT
    assert begin_reset(1.0, settled(rules, swinging), rules)[1] is Reason.RESET_SILENT
    safety, _ = begin_reset(0.0, settled(rules, swinging), rules)
    ends = [decide(None, None, 0.1, safety, rules)]
    ends.append(decide(None, None, 0.25, ends[0].safety, rules))
    assert [end.reset_ended for end in ends] == [None, Reason.RESET_SILENT]
    assert ends[1].pwm == 0.0 and ends[1].level is Level.ERROR


def test_an_integer_is_a_command_and_rules_take_the_lower_limit(
    nominal: Rig, rules: Rules
) -> None:
    assert make_rules(nominal, Limits(2.0)).limits.magnitude == nominal.pwm_limit
    assert make_rules(nominal, Limits(0.2)).guard.limit == 0.2
    assert take_command(1, settled(rules, MIDDLE))[1] is None


def test_a_twin_file_in_volts_is_refused(nominal: Rig) -> None:
    """Its force is of a volt: rail guard and reset would be wrong by the supply's voltage."""
    with pytest.raises(BadInputError, match=r"pwm_limit: expected at most 1, .* found 24 \(volts"):
        make_rules(replace(nominal, force_per_pwm_n=12.86 / 24, pwm_limit=24.0))
    assert make_rules(replace(nominal, pwm_limit=1.0), Limits(1.0)).limits.magnitude == 1.0


def test_of_two_writers_at_once_nobody_is_obeyed(nominal: Rig, rules: Rules) -> None:
    rig, sent = stepper(nominal, {}, (0.0, math.pi, 0.0, 0.0)), []
    safety = settled(rules, seen(rig))
    for k in range(120):
        now = 0.01 * (k + 1)
        numbers = (1000 + k, 1 + k) if k < 30 else (1000 + k,)
        for number in numbers:
            safety, _ = take_command(0.1, hear_writer(number, now, safety), now)
        decision = decide(None, seen(rig), now, safety, rules)
        safety = decision.safety
        sent.append(decision.pwm)
        rig.step(decision.pwm)
        if k == 20:
            assert decision.reasons == (Reason.TWO_WRITERS,) and decision.level is Level.ERROR
            assert (
                begin_reset(now, safety, rules)[1] is Reason.RESETTING
            )  # it needs no writer at all
    assert (
        not any(sent[1:79]) and sent[83] == 0.1
    )  # half a second after the second has fallen silent
    assert 100 < safety.counts.of_two_writers < 115


@pytest.mark.parametrize("lasting", [True, False])
def test_a_sample_that_cannot_be_true_brings_0_and_guards_no_rail(
    rules: Rules, monkeypatch: pytest.MonkeyPatch, lasting: bool
) -> None:
    fault = Reason.ENCODER_JUMPED if lasting else Reason.ENCODER_SPIKE
    good = decide(0.1, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety
    moving, _ = begin_reset(0.01, good, rules)
    monkeypatch.setattr(
        "pendulum_bridge.safety.encoder_check.check_sample",
        lambda encoders, *_: replace(encoders, fault=fault),
    )
    for safety in (good, moving):
        decision = decide(None, AT_THE_END, 0.02, safety, rules)
        assert (
            decision.pwm == 0.0 and decision.reasons[0] is fault and decision.safety.rig == MIDDLE
        )
        assert decision.reset_ended is (fault if lasting and safety.reset else None)
        assert press_stop(decision.safety)[0].stop.latched
    assert begin_reset(0.02, decision.safety, rules)[1] is (fault if lasting else Reason.RESETTING)
    assert decide(None, None, 0.5, decision.safety, rules).reasons[0] is Reason.RIG_SILENT
    trusted = []
    monkeypatch.setattr("pendulum_bridge.safety.encoder_check.trust_again", trusted.append)
    latched, _ = press_stop(decision.safety)
    assert clear_stop(latched, rules)[1] is Reason.ZERO_FIRST and not trusted
    assert (
        clear_stop(take_command(0.0, latched)[0], rules)[1] is Reason.STOP_CLEARED
        and len(trusted) == 1
    )


def test_an_answer_just_after_its_samples_decision_moves_as_far_as_at_the_sample(
    rules: Rules,
) -> None:
    """10 a second: 0.1 in a period, whenever in it, and no more however often it is decided."""
    safety, sent = settled(rules, MIDDLE), []
    for k in range(1, 6):
        safety = decide(None, MIDDLE, 0.01 * k, safety, rules).safety
        for part in range(1, 5):
            decision = decide(0.5, None, 0.01 * k + 0.0003 * part, safety, rules)
            safety = decision.safety
            sent.append(decision.pwm)
    assert sent[0] == pytest.approx(0.1) and sent[4] == pytest.approx(
        0.103 + 0.1 - 0.003, abs=0.004
    )
    assert sent[-1] == pytest.approx(0.5, abs=0.005)


def test_commands_to_and_fro_between_samples_move_no_further_than_time_allows(
    rules: Rules,
) -> None:
    """A thousand commands a second, each the other way: their ways add up to 10 PWM a second."""
    safety = decide(0.05, MIDDLE, 0.02, settled(rules, MIDDLE), rules).safety
    safety, way = decide(0.05, MIDDLE, 0.04, safety, rules).safety, 0.0
    for k in range(1, 501):
        sample = MIDDLE if k % 10 == 0 else None
        decision = decide(0.05 * (-1) ** k, sample, 0.04 + 1e-3 * k, safety, rules)
        way += abs(decision.pwm - safety.applied)
        safety = decision.safety
        assert way <= 10.0 * (1e-3 * k + rules.period_s) + 1e-9
    assert way > 4.0


def test_decisions_between_samples_do_not_disturb_a_reset(nominal: Rig, rules: Rules) -> None:
    ends = []
    for between in (0, 3):
        rig, now = stepper(nominal, {}, (0.3, 2.0, 0.0, 5.0)), 0.0
        safety, _ = begin_reset(0.0, settled(rules, seen(rig)), rules)
        ended = None
        while ended is None:
            for part in range(between):
                safety = decide(0.3, None, now + 0.002 * (part + 1), safety, rules).safety
            now += PERIOD_S
            decision = decide(None, seen(rig), now, safety, rules)
            safety, ended = decision.safety, decision.reset_ended
            rig.step(decision.pwm)
        ends.append((ended, now))
    assert ends[0][0] is ends[1][0] is Reason.RESET_DONE
    assert ends[1][1] == pytest.approx(ends[0][1], abs=0.05)


def test_commands_that_may_have_waited_while_the_driver_stood_still_are_not_taken(
    rules: Rules,
) -> None:
    before = decide(0.1, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety
    assert (
        take_command(0.3, before, 1.0)[1] is Reason.STOOD_STILL
    )  # the command wakes before the rig's thread
    resumed = decide(None, MIDDLE, 1.0, before, rules).safety
    assert take_command(0.3, resumed, 1.1, ago_s=0.2)[1] is Reason.STOOD_STILL
    assert take_command(0.3, resumed, 1.1, ago_s=0.02)[1] is None  # sent since then
    for k in range(120):
        resumed = decide(None, MIDDLE, 1.01 + 0.01 * k, resumed, rules).safety
    assert (
        resumed.applied == 0.0 and take_command(0.3, resumed, 2.21, ago_s=60.0)[1] is None
    )  # a clock that is wrong


@pytest.mark.parametrize("offset_s", [0.0, 3600.0, -3600.0, 1e-3, -1e-3])
def test_a_command_that_waited_is_refused_by_whatever_clock_it_was_sent(
    rules: Rules, offset_s: float
) -> None:
    """A busy computer takes commands late, up to the timeout, and none of them is refused."""
    random = np.random.default_rng(1)
    safety = settled(rules, MIDDLE)
    longest_s = rules.timeouts.command_s
    waits_s = (0.001, *random.uniform(0.0, 0.95 * longest_s, 200), *[0.9 * longest_s] * 20, 0.0)
    for wait_s in waits_s:
        safety, refused = take_command(0.1, safety, 0.0, offset_s + wait_s, longest_s)
        assert refused is None or len(safety.command_ages_s) == 1  # the first has no other yet
    late, refused = take_command(0.1, safety, 0.0, offset_s + 2.5 * longest_s, longest_s)
    assert refused is Reason.STOOD_STILL and late.counts.after_standstill > 0
    assert take_command(0.1, late, 0.0, offset_s + 0.01, longest_s)[1] is None


@pytest.mark.parametrize("set_by_s", [3600.0, -3600.0])
def test_a_clock_that_is_set_refuses_a_few_commands_at_most(rules: Rules, set_by_s: float) -> None:
    safety, answers = settled(rules, MIDDLE), []
    for k in range(40):
        age_s = 0.001 + (set_by_s if k >= 20 else 0.0)
        safety, refused = take_command(0.1, safety, 0.0, age_s, rules.timeouts.command_s)
        answers.append(refused)
    assert answers[:20] == [None] * 20 and answers[20] is Reason.STOOD_STILL
    assert answers[30:] == [None] * 10


def test_after_a_standstill_commands_of_a_clock_that_was_set_back_are_not_taken(
    rules: Rules,
) -> None:
    before = take_command(0.1, settled(rules, MIDDLE), 0.0, 0.001)[0]
    resumed = decide(None, MIDDLE, 1.0, before, rules).safety
    safety, refused = take_command(0.3, resumed, 1.01, ago_s=-3600.0)
    assert refused is Reason.STOOD_STILL
    assert take_command(0.3, safety, 1.02, ago_s=-3600.0)[1] is None


def test_a_command_to_an_inactive_driver_is_dropped_and_counted(rules: Rules) -> None:
    inactive, _ = deactivate(settled(rules, MIDDLE))
    safety, refused = take_command(0.3, inactive)
    assert refused is Reason.INACTIVE and safety.counts.while_inactive == 1
    assert decide(None, MIDDLE, 0.01, safety, rules).pwm == 0.0


def test_an_activated_driver_takes_no_command_of_before(rules: Rules) -> None:
    active = activate(deactivate(settled(rules, MIDDLE))[0], 5.0)
    active = replace(active, ages=replace(active.ages, now_s=5.04))
    assert take_command(0.3, active, 5.05, ago_s=0.06)[1] is Reason.STOOD_STILL
    assert take_command(0.3, active, 5.05, ago_s=0.04)[1] is None


def test_a_sample_that_was_looked_at_late_is_as_old_as_it_is(rules: Rules) -> None:
    """Two samples a period apart, the first looked at 8 ms late: the gap stays a period."""
    moved = RigState(0.003, math.pi, 0.3, 0.0)
    safety, _ = begin_reset(0.0, settled(rules, MIDDLE), rules)
    steps = []
    for first_late_s in (0.0, 0.008):
        first = decide(None, MIDDLE, 0.01 + first_late_s, safety, rules, ago_s=first_late_s)
        assert first.safety.ages.sample_s == first_late_s
        two = decide(None, moved, 0.02, first.safety, rules)
        steps.append(two.safety.reset)
    assert steps[0].bias != 0.0 and steps[1].bias == pytest.approx(steps[0].bias)


def test_after_a_failure_nothing_is_left_of_command_and_reset(rules: Rules) -> None:
    safety, ended = fail_safe(decide(0.3, MIDDLE, 0.01, settled(rules, MIDDLE), rules).safety)
    assert ended is None and decide(None, MIDDLE, 0.02, safety, rules).reasons == (
        Reason.NO_COMMAND_YET,
    )
    safety, ended = fail_safe(begin_reset(0.02, safety, rules)[0])
    assert ended is Reason.RESET_FAILED and safety.reset is None


EVENTS = st.lists(
    st.tuples(
        st.one_of(st.none(), st.floats()),
        st.booleans(),
        st.sampled_from([0.0, 0.001, 0.01, 0.01, 0.01, 0.3, -5.0]),
        st.sampled_from(["", "", "", "", "stop", "clear", "reset"]),
    ),
    max_size=60,
)


@settings(max_examples=150, deadline=None)
@given(EVENTS)
def test_whatever_happens_the_order_holds(rules: Rules, nominal: Rig, events: list) -> None:
    """Within the limit always; 0 while stopped or silent; every difference has its reason."""
    rig, now, safety = stepper(nominal, {}, (0.3, 2.0, 0.0, 5.0)), 0.0, make_safety(0.0)
    silent_s = math.inf
    for request, comes, step, event in events:
        if event == "stop":
            safety, _ = press_stop(safety)
        elif event == "clear":
            safety, _ = clear_stop(safety, rules)
        elif event == "reset":
            safety, _ = begin_reset(now, safety, rules)
        now += step
        silent_s = 0.0 if comes else silent_s + max(step, 0.0)
        decision = decide(request, seen(rig) if comes else None, now, safety, rules)
        safety = decision.safety
        assert abs(decision.pwm) <= 0.5 and safety.applied == decision.pwm
        if safety.stop.latched:
            assert (
                decision.reasons[0] is Reason.STOPPED
                and decision.pwm == 0.0
                and safety.reset is None
            )
        elif silent_s > 0.2 + 1e-9:
            assert decision.pwm == 0.0 and decision.level is Level.ERROR
        assert decision.reasons or decision.pwm == safety.command
        rig.step(decision.pwm)


def test_every_reason_has_a_sentence_of_its_own() -> None:
    sentences = [reason.sentence for reason in Reason]
    assert all(sentence.endswith((".", "?")) and sentence[0].isupper() for sentence in sentences)
    assert len(set(sentences)) == len(sentences)

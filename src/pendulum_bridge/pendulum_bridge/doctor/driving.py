"""Play a plan on a rig by the driver's own safety rules; however it ends, PWM 0 is sent last."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_bridge.doctor.pushes import Moment, Plan
from pendulum_bridge.doctor.track import Track
from pendulum_bridge.doctor.wire import Heard, Wire
from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Rules, Safety, make_safety
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError

WAIT_S = 0.02  # longest time without a decision, as in the driver
LONGEST_SILENCE_S = 0.5
OLD_SAMPLE_PERIODS = 1.5  # a sample that is older is surely followed by a newer sample
LAST_PACKETS = 5  # with PWM 0 at the end: any packet may be lost
BRAKING_S, COASTING_S, SLOW_M_S = 1.0, 0.5, 0.05
SILENT, BRAKED = (
    f"the rig sent nothing for {LONGEST_SILENCE_S:g} s",
    "the rail guard had to brake the cart",
)
GUARDED = {Reason.RAIL_BRAKING, Reason.RAIL_NOT_HELD, Reason.CART_DOUBTED}
JUMPED, STOOD, HUNG = (
    "a position jumped further than the rig can move",
    "the cart's position did not change at all",
    "the pole's angle did not change at all while the cart moved",
)
# reasons for which the safety rules stop sending
DISBELIEVED = {Reason.ENCODER_JUMPED: JUMPED, Reason.CART_STUCK: STOOD, Reason.POLE_STUCK: HUNG}


@dataclass(frozen=True)
class Driven[Seen]:
    """Hold how a plan was played.

    track: samples and commands.
    seen: what the plan returned; None when it was broken off.
    broken_off: why, in words; empty when the plan was played to its end.
    """

    track: Track
    seen: Seen | None
    broken_off: str = ""


@dataclass
class _Log:
    arrivals: list[float] = field(default_factory=list)
    samples: list[tuple[float, float, float, float]] = field(default_factory=list)
    sent_at: list[float] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)

    def track(self) -> Track:
        return Track(
            np.array(self.arrivals),
            np.array(self.samples),
            np.array(self.sent_at),
            np.array(self.sent),
        )


def play_plan[Seen](
    wire: Wire, plan: Plan[Seen], rules: Rules, signs_known: bool = True, reset: bool = False
) -> Driven[Seen]:
    """Play the plan until it ends or the rail guard has to brake.

    rules: the driver's safety rules for this rig.
    signs_known: whether the guard knows which way a command moves the cart; if not, PWM 0 is sent
        in place of its brake.
    reset: whether the reset flag is held meanwhile.
    Raises BadInputError when the network refuses a command.
    """
    log = _Log()
    try:
        seen, why, safety = _play(wire, plan, rules, reset, log)
        if why == BRAKED and signs_known:
            _brake(wire, safety, rules)
    finally:
        stop(wire)
    if why == JUMPED:
        _watch_coasting(wire, log)
    return Driven(log.track(), seen, why)


def stop(wire: Wire) -> None:
    """Send PWM 0 and no reset, several times.

    Raises BadInputError when the network refuses every packet.
    """
    refusals = []
    for _ in range(LAST_PACKETS):
        try:
            wire.send(Command(0.0))
        except BadInputError as error:
            refusals.append(error)
    if len(refusals) == LAST_PACKETS:
        raise refusals[-1]


def _play[Seen](
    wire: Wire, plan: Plan[Seen], rules: Rules, reset: bool, log: _Log
) -> tuple[Seen | None, str, Safety]:
    """Return what the plan returned, why it was broken off, and the last safety state."""
    begin = heard_s = wire.now()
    safety = make_safety(begin)
    next(plan)
    while True:
        heard = wire.receive(wire.now() + WAIT_S)
        state, now = _note(heard, log), wire.now()
        heard_s = heard_s if state is None else now
        if now - heard_s > LONGEST_SILENCE_S:
            return None, SILENT, safety
        if heard is not None and now - heard.at_s > OLD_SAMPLE_PERIODS * rules.period_s:
            continue
        request = None
        if state is not None:
            try:
                request = plan.send(Moment(now - begin, state))
            except StopIteration as over:
                return over.value, "", safety
        decision = decide(request, state, now, safety, rules)
        safety = decision.safety
        if why := next(
            (DISBELIEVED[reason] for reason in decision.reasons if reason in DISBELIEVED), ""
        ):
            return None, why, safety
        if GUARDED & set(decision.reasons):
            if state is not None:
                return None, BRAKED, safety
            safety = replace(
                safety, applied=0.0
            )  # nothing new is heard: no brake for a cart that nobody sees
        wire.send(Command(safety.applied, reset))
        log.sent_at.append(wire.now())
        log.sent.append(safety.applied)


def _watch_coasting(wire: Wire, log: _Log) -> None:
    """Note for a while how the cart coasts: these samples show why they were not believed."""
    end = wire.now() + COASTING_S
    while wire.now() < end:
        _note(wire.receive(end), log)


def _brake(wire: Wire, safety: Safety, rules: Rules) -> None:
    """Send the guard's brake until the cart stands."""
    end = wire.now() + BRAKING_S
    while wire.now() < end:
        state = _note(wire.receive(wire.now() + WAIT_S), _Log())
        decision = decide(0.0, state, wire.now(), safety, rules)
        safety = decision.safety
        wire.send(Command(decision.pwm))
        if state is not None and abs(state.cart_m_s) < SLOW_M_S:
            return


def _note(heard: Heard | None, log: _Log) -> RigState | None:
    if heard is None:
        return None
    try:
        sample = Sample.unpack(heard.packet)
    except BadInputError:
        return None
    log.arrivals.append(heard.at_s)
    log.samples.append((sample.pole_rad, sample.pole_rate, sample.cart_m, sample.cart_velocity))
    return RigState(sample.cart_m, sample.pole_rad, sample.cart_velocity, sample.pole_rate)

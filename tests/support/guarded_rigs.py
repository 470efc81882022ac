"""Random rigs about the nominal rig, moved by the twin's equations, driven through the safety."""

from dataclasses import replace

import numpy as np

from pendulum_bridge.safety.decide import Decision, decide
from pendulum_bridge.safety.events import begin_reset
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Rules, Safety, make_safety
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig
from pendulum_twin.stepper import Stepper

PERIOD_S = 0.01
SPREAD = 0.3
VARIED = (
    "cart_mass_kg",
    "pole_mass_kg",
    "com_distance_m",
    "pole_inertia_kg_m2",
    "force_per_pwm_n",
    "cart_viscous_n_s_m",
    "pole_viscous_n_m_s",
)


def varied(nominal: Rig, random: np.random.Generator, corner: bool = False) -> Rig:
    """Return a rig with constants up to SPREAD off; in a corner each is exactly that far off."""
    share = (
        random.choice([-1.0, 1.0], len(VARIED)) if corner else random.uniform(-1, 1, len(VARIED))
    )
    return replace(
        nominal,
        **{
            name: getattr(nominal, name) * (1 + SPREAD * s)
            for name, s in zip(VARIED, share.tolist(), strict=True)
        },
    )


def stepper(rig: Rig, effects: dict, start: tuple[float, ...]) -> Stepper:
    return Stepper(Twin("random", rig, effects), PERIOD_S, start)


def seen(rig: Stepper) -> RigState:
    return RigState(*rig.state.tolist())


def settled(rules: Rules, sample: RigState, now_s: float = 0.0) -> Safety:
    """Return a state that has heard the rig once."""
    return decide(None, sample, now_s, make_safety(now_s), rules).safety


def reset_run(rig: Stepper, rules: Rules) -> tuple[Decision, float, float]:
    """Return the decision that ended a reset, when (s), and the cart's largest distance (m)."""
    safety, reason = begin_reset(0.0, settled(rules, seen(rig)), rules)
    assert reason is Reason.RESETTING
    furthest = abs(rig.state[0])
    for k in range(1, round(2 * rules.swing.deadline_s / PERIOD_S)):
        decision = decide(None, seen(rig), k * PERIOD_S, safety, rules)
        if decision.reset_ended is not None:
            return decision, k * PERIOD_S, furthest
        safety = decision.safety
        furthest = max(furthest, abs(float(rig.step(decision.pwm)[0])))
    raise AssertionError("the reset never ended")

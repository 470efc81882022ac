"""Cart and pole on MuJoCo, step by step, under a command and the laws of what is concealed."""

from __future__ import annotations

import math

import mujoco

from pendulum_bridge.emulator.laws import Laws
from pendulum_bridge.emulator.load import find_load
from pendulum_bridge.emulator.mjcf import build_model
from pendulum_bridge.emulator.seal import Concealed

CART, POLE, MOTOR = 0, 1, 2
CART_BODY = 1  # body 0 is the world
# A step in which a joint reverses is cut finer: dry friction is of first order in the step.
REVERSAL_SUBSTEPS = 32
STICKING_SPEED = 1e-6  # m/s, rad/s: below it a joint with dry friction counts as sticking

# x (m), th (rad, 0 where the centre of mass is upright), v (m/s), w (rad/s)
State = tuple[float, float, float, float]


class Engine:
    """Hold the mechanics; the same steps give the same bits.

    concealed: rig and effects.
    laws: the laws that the engine does not have itself.
    step_s: the usual step, for which the stiffness of dry friction is chosen.
    """

    def __init__(self, concealed: Concealed, laws: Laws, step_s: float) -> None:
        self._model = build_model(concealed.rig, concealed.effects, step_s / REVERSAL_SUBSTEPS)
        self._data = mujoco.MjData(self._model)
        self._laws = laws
        self._load = find_load(concealed)
        self._force_n = concealed.rig.force_per_pwm_n or 0.0
        self._ahead_rad = concealed.effects.get("pole_imbalance", {}).get("angle_rad", 0.0)
        self._dry = bool(laws.dry) or bool(self._model.dof_frictionloss.any())
        # MuJoCo's own arrays, seen through numpy: each attribute access costs a tenth of a step.
        self._qpos, self._qvel, self._qacc = self._data.qpos, self._data.qvel, self._data.qacc
        self._applied, self._loss = self._data.qfrc_applied, self._model.dof_frictionloss
        self._driven = MOTOR if self._model.nv > MOTOR else CART
        self._time_s, self._substep_s = 0.0, step_s / REVERSAL_SUBSTEPS

    def put(self, state: tuple[float, ...]) -> None:
        """Go on from the state, and forget the motion before it."""
        x, th, v, w = state
        self._qpos[:MOTOR], self._qvel[:MOTOR] = (x, th - self._ahead_rad), (v, w)
        self._qpos[MOTOR:], self._qvel[MOTOR:] = x, v  # the belt is not stretched
        self._qacc[:] = self._data.qacc_warmstart[:] = 0.0

    @property
    def state(self) -> State:
        """Return where cart and pole are."""
        (x, angle), (v, w) = self._qpos.tolist()[:MOTOR], self._qvel.tolist()[:MOTOR]
        return x, angle + self._ahead_rad, v, w

    def step(self, command: float, step_s: float) -> None:
        """Hold what the drive makes of the command (PWM fraction) for step_s."""
        substeps = REVERSAL_SUBSTEPS if self._dry and self._may_reverse(step_s) else 1
        substep_s = step_s / substeps
        if substep_s != self._substep_s:
            self._model.opt.timestep = self._substep_s = substep_s
        if self._load is not None and self._time_s + 0.5 * step_s >= self._load.time_s:
            self._add_load(self._load.load_kg)
        if not self._laws.of_state:
            self._applied[self._driven] = self._force_n * command
        for _ in range(substeps):
            if self._laws.of_state:
                self._apply(command, substep_s)
            mujoco.mj_step(self._model, self._data)
            self._time_s += substep_s

    def _add_load(self, load_kg: float) -> None:
        """Make the cart heavier, kg; the engine works out anew what depends on its mass."""
        self._model.body_mass[CART_BODY] += load_kg
        mujoco.mj_setConst(self._model, mujoco.MjData(self._model))
        self._load = None

    def _may_reverse(self, step_s: float) -> bool:
        """Return whether a joint with dry friction moves and may reverse in the step."""
        loss, speeds, changes = self._loss.tolist(), self._qvel.tolist(), self._qacc.tolist()
        for level, v, a in zip(loss, speeds, changes, strict=True):
            if level > 0 and STICKING_SPEED < abs(v) < 2 * abs(a) * step_s:
                return True
        return False

    def _apply(self, command: float, step_s: float) -> None:
        """Set force, torque and dry friction by the laws, for the state in the step's middle."""
        (x, angle), (v, w), (a, b) = (
            values.tolist()[:MOTOR] for values in (self._qpos, self._qvel, self._qacc)
        )
        half = 0.5 * step_s
        t, x, th = (
            self._time_s + half,
            x + half * (v + 0.5 * half * a),
            angle + self._ahead_rad + half * (w + 0.5 * half * b),
        )
        v, w = v + half * a, w + half * b
        for gain in self._laws.gain:
            command = gain(command, t, x, th, v, w)
        push = sum([law(t, x, th, v, w) for law in self._laws.push])
        self._applied[CART] = push
        self._applied[self._driven] = (
            self._force_n * command + push if self._driven == CART else self._force_n * command
        )
        self._applied[POLE] = sum([law(t, x, th, v, w) for law in self._laws.twist])
        if self._laws.dry is not None:
            # A cart that sticks creeps the way it is pushed (see `mjcf`): its velocity has the
            # sign of the push.
            self._loss[CART] = self._laws.dry(math.copysign(1.0, v), t, x, th, v, w)

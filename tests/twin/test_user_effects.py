"""An effect of the user's own: a sensor whose inverse calls its law."""

import os
import subprocess
import sys

EFFECT = '''
"""The pole's sensor bends once a turn."""
from pendulum_twin.effects.effect import Effect, Form, Parameter, Place
from pendulum_twin.elementary import sin_cos


def law(x, v, th, w, t, bend_rad):
    sine, cosine = sin_cos(th)
    return x, v, th + bend_rad * sine, w * (1.0 + bend_rad * cosine)


def inverse(x, v, th, w, t, bend_rad):
    true = th
    for _ in range(40):
        true = true + th - law(x, v, true, w, t, bend_rad)[2]
    return x, v, true, w / law(x, v, true, 1.0, t, bend_rad)[3]


EFFECT = Effect(
    name="bent_sensor",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(Parameter("bend_rad", "rad", 0.0, -0.4, 0.4, (0.05,)),),
    sentence="The pole's sensor bends by {bend_rad}.",
    source="made for a test",
)
'''
PROGRAM = """
import numpy as np
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import Rig
from pendulum_twin.sensors import apply_sensors, undo_sensors
rig = Rig(cart_mass_kg=1.0, force_per_pwm_n=1.0, cart_viscous_n_s_m=1.0)
theta = make_theta(Twin("test", rig, {"bent_sensor": {"bend_rad": 0.3}}))[None]
states, t = np.random.default_rng(0).normal(size=(1, 9, 4)), np.zeros((1, 9))
shown = apply_sensors(states, theta, t)
print(np.max(np.abs(shown - states)) > 0.1, np.max(np.abs(undo_sensors(shown, theta, t) - states)))
"""


def test_the_inverse_of_a_users_sensor_may_call_its_law(tmp_path):
    """Functions of the effect's file are compiled as the law is, with the kernel's sine."""
    (tmp_path / "bent_sensor.py").write_text(EFFECT, encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=os.environ | {"PENDULUM_EFFECTS": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    differs, error = run.stdout.split()
    assert differs == "True" and float(error) < 1e-12

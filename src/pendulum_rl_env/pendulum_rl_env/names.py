"""The names that command lines offer; nothing here needs torch."""

from __future__ import annotations

PRESETS = ("fast", "frugal", "residual", "thesis")
IN_PROCESS = "pendulum_rl_env/InvertedPendulum-v0"
OVER_TOPICS = "pendulum_rl_env/InvertedPendulumRos-v0"

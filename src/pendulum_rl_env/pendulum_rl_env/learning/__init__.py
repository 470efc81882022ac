"""Learning with torch and stable-baselines3: presets, learners, callbacks, results, export."""

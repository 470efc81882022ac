"""What needs torch: stable-baselines3 on the fleet, presets, results, export."""

"""Plan what to play on a rig: commands over time, and plan files."""

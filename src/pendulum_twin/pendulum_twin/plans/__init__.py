"""What to play on a rig: plans of commands, their files, and what keeps the cart on the rail meanwhile."""

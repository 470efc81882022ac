"""Plan experiments: what a plan will show, and which plan to play next."""

"""Watch a rig beside its twin, and name the place of the chain that changes."""

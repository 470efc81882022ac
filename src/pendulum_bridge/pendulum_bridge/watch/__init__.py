"""Watch a rig beside its twin: which place of the chain has changed, since when, and by how much."""

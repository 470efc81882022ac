"""Play an excitation plan on the rig, and stop where the rig leaves its bounds."""

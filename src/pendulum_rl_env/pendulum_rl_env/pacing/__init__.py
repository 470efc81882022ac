"""How an environment keeps pace with a rig that messages reach: in lockstep or in real time."""

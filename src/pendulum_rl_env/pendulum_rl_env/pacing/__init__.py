"""How an environment keeps pace with a rig that is reached by messages: in lockstep, or in real time."""

"""A rig emulated on MuJoCo, with concealed physics: an engine that shares no formula with the twin."""

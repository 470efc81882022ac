"""An rig on MuJoCo: concealed effects, and physics that shares no formula with the twin."""

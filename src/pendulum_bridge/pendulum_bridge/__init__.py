"""The rig's side: wire protocol, limits, excitation, and an emulated rig on MuJoCo."""

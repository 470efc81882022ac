"""The running driver: samples and commands in, decisions out to the rig."""

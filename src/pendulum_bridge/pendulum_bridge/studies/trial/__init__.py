"""Trials of a diagnosis: emulated rigs with concealed physics, recorded faster than real time."""

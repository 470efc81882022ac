"""Trials of a diagnosis: emulated rigs with concealed physics, recorded in process, faster than real time."""

"""Gymnasium environments on the twin or the rig."""

"""Fit twins to windows of a recording."""

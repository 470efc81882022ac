"""Measure what has no name: a law as a curve with a band, and the shape that it has."""

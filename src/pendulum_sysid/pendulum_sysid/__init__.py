"""Diagnosis of recordings: where the twin is wrong, which physics is missing, and by how much."""

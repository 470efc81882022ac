"""The errors of studies: what went wrong with their own machinery, not with what a user gave."""

from __future__ import annotations


class WorkerError(Exception):
    """Say that a process of a study ended before its work was done, and how to go on."""

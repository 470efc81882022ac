"""The stages of a diagnosis, as the lines of progress with which they begin."""

from __future__ import annotations

from enum import StrEnum


class Stage(StrEnum):
    """Name a stage: a text for whoever prints progress, a member for whoever measures it.

    In the order in which they come; SUBSETS and LAWS are left out where the model is right without
    them.
    """

    READING = "reading the recordings"
    PREPARING = "cleaning and smoothing the motion"
    CONSTANTS = "fitting the rig's constants alone"
    POLE = "asking the pole by itself, its axis moved as recorded"
    GROWING = "asking what is missing, an effect at a time"
    SUBSETS = "trying effects that help only together"
    LONG = "following small errors over a whole second"
    NAMING = "asking which other names would do as well"
    TIES = "asking what this recording cannot tell apart"
    REPLICATING = "asking parts of the recordings for the names again"
    JUDGING = "locating what is missing, measuring the noise floor"
    PLANNING = "planning the next experiment"
    LAWS = "measuring what has no name, which takes as long as all before, or longer"
    WRITING = "writing the report"

"""What ends a program in a sentence for a person, a class a cause."""


class ReportedError(Exception):
    """Say what went wrong and what to do; a program prints it and ends.

    exit_status: of the program.
    """

    exit_status = 1


class BadInputError(ReportedError):
    """Say what input was expected, what was found, and what to do."""


class RigError(ReportedError):
    """Say that a rig or a twin failed: it is silent, refuses, or lost samples."""


class WorkerError(ReportedError):
    """Say that a program which does a part of the work ended too early, and how to go on."""

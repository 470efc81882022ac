"""The error that bad input ends in: a sentence for a person."""


class BadInputError(Exception):
    """Say what was expected, what was found, and what to do; a program prints it and ends.

    exit_status: of the program.
    """

    exit_status = 1

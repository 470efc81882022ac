"""The verbs of `sysid`, one a module: `run(arguments)` prints the answer to the options given.

`run` returns the exit status, and raises an error of `errors` without an answer.
"""

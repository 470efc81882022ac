"""The verbs of `sysid`, one a module: each has `run(arguments)`, its options as `options` has them, and prints the answer.

`run` returns the exit status and raises BadInputError when the question could not be answered.
"""

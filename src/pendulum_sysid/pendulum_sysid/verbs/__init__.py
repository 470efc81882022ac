"""The verbs (subcommands) of `sysid`, a module each with a function `run(arguments)`.

`run` prints what was asked for and returns the exit status. Where there is nothing to print, it
raises an error of the module `errors`, which `cli` prints.
"""

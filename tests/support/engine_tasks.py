"""Tasks that workers run for tests of the engine.

They import little: a worker that has ended imports them anew.
"""

import os
import time
from pathlib import Path

from pendulum_twin.errors import BadInputError
from support.polling import until


def act_as_told(item: object) -> object:
    """Square a number; a word says what to do instead. A path is written to by its worker."""
    if item == "die":
        os._exit(9)
    if item == "hang":
        time.sleep(1e6)  # longer than any time limit: the engine has to end it
    if item == "complain":
        raise BadInputError("no")
    if isinstance(item, Path):
        item.write_text(str(os.getpid()))
        until(item.with_suffix(".go").is_file, "leave to go on")
        return str(item)
    return item * item


def get_process(item: object) -> int:
    """Return the process that runs the task."""
    return os.getpid()


def end_process(*arguments: object) -> Path:
    """End the process that runs this at once, as one that the kernel kills."""
    os._exit(3)

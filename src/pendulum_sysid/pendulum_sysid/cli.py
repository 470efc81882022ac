"""The command `sysid`: parse, call, exit status.

Exit status: 0 the question was answered; 1 it was not, and a sentence on stderr says why; 2 wrong
use; 130 interrupted. A verb's module is imported when the verb runs, so that help comes at once.
"""

from __future__ import annotations

import os
import shlex
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.verbs.options import make_parser
from pendulum_sysid.verbs.progress import Progress
from pendulum_sysid.verbs.said import INTERRUPTED, NOT_ANSWERED, WRONG_USE, say
from pendulum_twin.errors import BadInputError, ReportedError
from pendulum_twin.parser import complete
from pendulum_twin.user_effects import take_effects_option

MODULES = {  # verb -> module, whose `run(arguments)` returns the exit status
    "diagnose": "verbs.diagnose",
    "fit": "verbs.fit",
    "replay": "verbs.replay",
    "compare": "verbs.compare",
    "effects": "verbs.effects",
    "learn": "verbs.learn",
    "check": "verbs.check",
    "import": "verbs.import_csv",
    "next": "verbs.next",
    "open": "verbs.open_report",
    "prove": "studies.prove",
    "fleet": "verbs.fleet",
}

LONG_VERBS = ("diagnose", "fit", "next")  # that begin with reading; prove and fleet say more


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status; argparse ends wrong use with status 2 by itself."""
    given = sys.argv[1:] if argv is None else list(argv)
    try:
        parser = make_parser()
        complete(parser)
        arguments = parser.parse_args(take_effects_option(given))
    except BadInputError as error:
        return say(str(error), WRONG_USE)
    arguments.shell_line = shlex.join(["sysid", *given])
    try:
        progress = Progress(sys.stderr, arguments.quiet)
        with warnings.catch_warnings(), progress as arguments.progress:
            if arguments.verb in LONG_VERBS:
                progress.report(Stage.READING)  # importing takes a while, too
            # A run that overflows is reported by the verb, not by a warning of numpy.
            warnings.simplefilter("ignore")
            verb = import_module(f"pendulum_sysid.{MODULES[arguments.verb]}")
            status: int = verb.run(arguments)
            sys.stdout.flush()
        return status
    except ReportedError as error:
        return say(str(error), error.exit_status)
    except KeyboardInterrupt:
        return say("stopped by the keyboard before the question was answered", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone; Python would complain once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return NOT_ANSWERED
    except Exception as error:
        if arguments.traceback:
            raise
        kind = type(error).__name__
        return say(
            f"internal error ({kind}: {error}): please report it, with --traceback for details"
        )


if __name__ == "__main__":
    sys.exit(main())

"""A program beside the page, in a process of its own: its output by lines, and its end."""

from __future__ import annotations

import asyncio
import signal
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from pendulum_twin.errors import BadInputError

LONGEST_LINE = 2**20  # bytes
LAST_LINES = 20  # kept, to say why a program failed
GRACE_S = 3.0  # from SIGINT to SIGKILL when the page ends
GIVEN_UP_S = 0.5  # from SIGINT to SIGKILL when a person waits for the end
# Before a command that must never hold up rig, feed or stop. Beside a busy program it has a tenth
# of a core; at 19, the lowest priority, it has a hundredth, and a verdict takes an hour.
GENTLY = ("nice", "-n", "10")


class Child:
    """Hold a running program; the event loop that started it alone calls this.

    lines: the last lines of its output, stdout and stderr together.
    """

    def __init__(self, process: asyncio.subprocess.Process, hear: Callable[[str], None]) -> None:
        self._process, self._hear = process, hear
        self.lines: deque[str] = deque(maxlen=LAST_LINES)
        self._reading = asyncio.create_task(self._read())

    @classmethod
    async def start(
        cls, command: Sequence[str], environment: Mapping[str, str], hear: Callable[[str], None]
    ) -> Child:
        """Start a program.

        environment: all its variables.
        hear: gets each line of its output.
        Raises BadInputError when the program cannot be run.
        """
        starting = asyncio.create_task(
            asyncio.create_subprocess_exec(
                *command,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
                env=environment,
                limit=LONGEST_LINE,
                process_group=0,  # Ctrl-C reaches the node alone, which ends its programs
            )
        )
        try:
            return cls(await asyncio.shield(starting), hear)
        except asyncio.CancelledError:  # a start that is cancelled itself may never come back
            await cls(await starting, hear).end()
            raise
        except OSError as error:
            raise BadInputError(
                f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
            ) from error

    @property
    def last_line(self) -> str:
        """Return what it said last; "" when it has said nothing."""
        return next((line for line in reversed(self.lines) if line.strip()), "")

    async def wait(self) -> int:
        """Wait until it has ended and all that it said is read; return its exit status."""
        await asyncio.shield(self._reading)
        return await self._process.wait()

    def interrupt(self) -> None:
        """Ask it to end, as Ctrl-C does."""
        with suppress(ProcessLookupError):
            self._process.send_signal(signal.SIGINT)

    async def end(self, grace_s: float = GRACE_S) -> None:
        """End it: with SIGINT, and with SIGKILL when it has not ended after the grace.

        Whoever is cancelled here leaves no program behind: it is killed at once.
        """
        if self._process.returncode is None:
            self.interrupt()
            try:
                await asyncio.wait_for(self._process.wait(), grace_s)
            except TimeoutError:
                self._kill()
                await self._process.wait()
            except asyncio.CancelledError:
                self._kill()
                raise
        self._reading.cancel()  # what it has started may hold its output open
        await asyncio.gather(self._reading, return_exceptions=True)

    def _kill(self) -> None:
        with suppress(ProcessLookupError):
            self._process.kill()

    async def _read(self) -> None:
        assert self._process.stdout is not None
        async for line in self._process.stdout:
            text = line.decode(errors="replace").rstrip()
            self.lines.append(text)
            self._hear(text)


async def wait_for_either(event: asyncio.Event, child: Child) -> bool:
    """Wait until an event is set or a program has ended; return whether the event is set."""
    waits = asyncio.create_task(event.wait()), asyncio.create_task(child.wait())
    try:
        await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for each in waits:
            each.cancel()
        await asyncio.gather(*waits, return_exceptions=True)
    return event.is_set()

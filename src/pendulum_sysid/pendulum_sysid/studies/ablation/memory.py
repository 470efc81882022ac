"""Remember results for as long as every decision that was read in making them stays the same.

A variant of one decision then costs only the stages that read it, and those whose input changes.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from pendulum_sysid import decisions

Reads = dict[str, Any]


class Memory:
    """Keep results by function and arguments, with the decisions that were read for each."""

    def __init__(self) -> None:
        self._kept: dict[Hashable, list[tuple[Reads, Any]]] = defaultdict(list)
        self._open: list[Reads] = []

    def wrap(self, function: Callable[..., Any], make_key: Callable[..., Hashable]) -> Any:
        """Return the function with a memory; make_key: makes its arguments comparable."""

        def call(*arguments: Any, **options: Any) -> Any:
            entries = self._kept[function, make_key(*arguments, **options)]
            for reads, result in entries:
                if all(vars(decisions)[name] == value for name, value in reads.items()):
                    self._note(reads)
                    return result
            with self.watch() as reads:
                result = function(*arguments, **options)
            entries.append((reads, result))
            return result

        return call

    @contextmanager
    def watch(self) -> Iterator[Reads]:
        """Collect the decisions that are read meanwhile."""
        reads: Reads = {}
        self._open.append(reads)
        try:
            yield reads
        finally:
            self._open.pop()
            self._note(reads)

    def _note(self, reads: Reads) -> None:
        if self._open:
            self._open[-1].update(reads)

    @contextmanager
    def trace(self) -> Iterator[None]:
        """Notice every decision that is read, by whatever module."""
        memory = self

        class Traced(ModuleType):
            def __getattribute__(self, name: str) -> Any:
                value = super().__getattribute__(name)
                if name.isupper():
                    memory._note({name: value})
                return value

        plain = decisions.__class__
        decisions.__class__ = Traced
        try:
            yield
        finally:
            decisions.__class__ = plain

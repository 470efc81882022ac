"""Find the program of this machine that uses a UDP port, as far as Linux shows it to this user."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

PROC = Path("/proc")
UNKNOWN_OWNER = "another program"
LOCAL, INODE = 1, 9  # columns of /proc/net/udp


def find_owner(port: int, proc: Path = PROC) -> str:
    """Return 'NAME (process NUMBER)' of the program that listens on a UDP port.

    Returns 'another program' when Linux does not show it.
    """
    sockets = {f"socket:[{inode}]" for inode in _find_inodes(port, proc)}
    for process in sorted(proc.glob("[0-9]*")) if sockets else []:
        if sockets & _list_open_files(process):
            return f"{_read_name(process)} (process {process.name})"
    return UNKNOWN_OWNER


def _find_inodes(port: int, proc: Path) -> list[str]:
    try:
        rows = [line.split() for line in (proc / "net" / "udp").read_text().splitlines()[1:]]
    except OSError:
        return []
    return [
        row[INODE]
        for row in rows
        if len(row) > INODE and int(row[LOCAL].rpartition(":")[2], 16) == port
    ]


def _list_open_files(process: Path) -> set[str]:
    files = set()
    with suppress(OSError):  # of another user, or just ended
        for descriptor in (process / "fd").iterdir():
            files.add(str(descriptor.readlink()))
    return files


def _read_name(process: Path) -> str:
    """Return the program's name; of a Python program, the name of its script or module."""
    try:
        words = (process / "cmdline").read_text().split("\0")
    except (OSError, UnicodeDecodeError):
        return UNKNOWN_OWNER
    program = Path(words[0]).name
    if program.startswith("python"):
        script = next((word for word in words[1:] if word and not word.startswith("-")), "")
        return Path(script).name or program
    return program or UNKNOWN_OWNER

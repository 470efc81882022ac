"""Which program of this machine uses a UDP port, as far as Linux tells this user."""

from __future__ import annotations

from pathlib import Path

PROC = Path("/proc")
UNKNOWN_OWNER = "another program"
LOCAL, INODE = 1, 9  # columns of /proc/net/udp


def find_owner(port: int, proc: Path = PROC) -> str:
    """Return 'NAME (process NUMBER)' of who listens on a UDP port, or 'another program' when that is not shown."""
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
    found = set()
    try:
        for each in (process / "fd").iterdir():
            found.add(str(each.readlink()))
    except OSError:
        pass  # of another user, or just ended
    return found


def _read_name(process: Path) -> str:
    """Return the program's name; for one that an interpreter runs, the script's or module's."""
    try:
        words = (process / "cmdline").read_text().split("\0")
    except (OSError, UnicodeDecodeError):
        return UNKNOWN_OWNER
    program = Path(words[0]).name
    if program.startswith("python"):
        script = next((word for word in words[1:] if word and not word.startswith("-")), "")
        return Path(script).name or program
    return program or UNKNOWN_OWNER

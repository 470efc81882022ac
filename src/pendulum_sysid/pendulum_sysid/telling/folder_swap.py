"""Put the files of an answer into a folder at once: all of the new answer, or all of the old.

A command that is killed while it writes leaves the old answer. A folder that holds nothing else
is exchanged in one step. Where other files stand, or somebody stands in the folder, files are
exchanged one by one, the chief file removed first and put last: where it stands, all files beside
it are of its answer.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

AT_FDCWD, RENAME_EXCHANGE = -100, 2  # linux/fs.h
UNSUPPORTED = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP, errno.EXDEV, errno.EBUSY)


@contextmanager
def replace_files(
    folder: Path, names: tuple[str, ...], keep: Path | None = None
) -> Iterator[Path]:
    """Yield a folder to write into, and put its files in the place of those of an older answer.

    folder: of the answer; need not exist.
    names: of all files that an answer may have, the chief file first. Files of an older answer
        that the new answer lacks are removed.
    keep: a file that is not removed, whatever its name; None for none.

    The old answer stays as it is when the body raises. Raises OSError where nothing can be
    written.
    """
    folder = Path(os.path.realpath(folder))
    folder.parent.mkdir(parents=True, exist_ok=True)
    place = folder.parent
    if folder.exists() and (os.path.ismount(folder) or not os.access(place, os.W_OK | os.X_OK)):
        place = folder  # nothing can be exchanged with a folder beside it
    with tempfile.TemporaryDirectory(dir=place, prefix=f".{folder.name}.") as temporary:
        new = Path(temporary) / folder.name
        new.mkdir()
        yield new
        if not folder.exists():
            new.rename(folder)
        elif not (_is_ours_alone(folder, names, keep) and _replace_folder(new, folder)):
            _move_files(new, folder, names, keep)


def _is_ours_alone(folder: Path, names: tuple[str, ...], keep: Path | None) -> bool:
    """Tell whether the folder holds files of an answer alone, and nobody is known to be in it."""
    entries = list(folder.iterdir())
    kept = keep is not None and keep.exists() and folder == Path(os.path.realpath(keep)).parent
    ours = all(entry.name in names and entry.is_file() for entry in entries)
    return ours and not kept and not os.path.samefile(folder, Path.cwd())


def _replace_folder(new: Path, old: Path) -> bool:
    """Exchange two folders in one step; tell whether the system can."""
    renameat2 = getattr(ctypes.CDLL(None, use_errno=True), "renameat2", None)
    if renameat2 is None:
        return False
    shutil.copymode(old, new)
    if renameat2(AT_FDCWD, os.fsencode(new), AT_FDCWD, os.fsencode(old), RENAME_EXCHANGE) == 0:
        return True
    code = ctypes.get_errno()
    if code in UNSUPPORTED:
        return False
    raise OSError(code, os.strerror(code), str(old))


def _move_files(new: Path, folder: Path, names: tuple[str, ...], keep: Path | None) -> None:
    """Remove the chief file, put the others in their places, and the chief file last."""
    for name in names:
        target = folder / name
        kept = keep is not None and keep.exists() and target.exists() and target.samefile(keep)
        if name == names[0] or not ((new / name).exists() or kept):
            target.unlink(missing_ok=True)
    for name in reversed(names):
        if (new / name).exists():
            (new / name).replace(folder / name)

"""A watched folder: every file that an instrument writes is fitted as soon as it is complete."""

from __future__ import annotations

import time
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import Log
from ..identification.batch import Batch, FileFit
from .each import checked, identify_each
from .given import Given, quantity

#: Suffixes of files that are not measurements.
_NOT_DATA = (".toml", ".json", ".png", ".pdf", ".svg", ".html", ".htm", ".log", ".nc", ".part", ".tmp", ".md", ".tex")
#: Options of `identify_each` that are none of `identify`.
_OF_EACH = ("jobs", "call", "force")
#: Longest time [s] between two looks.
_LOOK = 0.5

#: Size and time of the last change, by which a file is known to be still.
_State = tuple[int, int]


def watch(
    folder: str | Path,
    into: str | Path,
    strip: Any = None,
    *,
    pattern: str = "*",
    settle: Given = 2.0,
    idle: Given | None = None,
    told: Callable[[FileFit], object] | None = None,
    log: str | Path | None = None,
    **options: Any,
) -> Batch:
    """Return the fits of the files of a folder, each fitted when it has been still; new and changed ones as they come.

    It ends when no file has changed for ``idle``; without that it goes on until it is interrupted. Folders in it are
    not looked into.

    Parameters
    ----------
    folder
        Where the instrument writes.
    into
        Where fits and their table are left, see `identify_each`; the table is written again after every file.
    strip
        Of all files, see `identify`.
    pattern
        Names of files that are measurements.
    settle
        How long [s] a file's size and time must have been still.
    idle
        How long [s] nothing must have changed for the end.
    told
        Called with each new `FileFit`.
    log
        File to which a line a new file is appended: time, file, outcome.
    **options
        Of `identify_each`.

    Raises
    ------
    InputError
        There is no such folder, or an option is wrong.
    """
    place, still = Path(folder), quantity(settle, "s", "settle")
    patience = None if idle is None else quantity(idle, "s", "idle")
    require_watchable(place)
    checked(strip, {name: value for name, value in options.items() if name not in _OF_EACH})
    since: dict[Path, tuple[_State, float]] = {}
    fitted: dict[Path, _State] = {}
    rows: dict[str, FileFit] = {}
    changed, batch, tell = time.monotonic(), Batch(()), None if log is None else Log(log)

    def take(found: FileFit) -> None:
        rows[found.path] = found
        if told:
            told(found)
        if tell:
            tell(found.path, found.outcome)

    while True:
        now, files = time.monotonic(), _files(place, pattern)
        for path, state in files.items():
            if path not in since or since[path][0] != state:
                since[path], changed = (state, now), now
        ready = [path for path, state in files.items() if now - since[path][1] >= still]
        new = {path: files[path] for path in ready if fitted.get(path) != files[path]}
        if new:
            standing = {str(path): rows[str(path)] for path in ready if path in fitted and path not in new}
            batch = identify_each(ready, strip, folder=into, done=take, known=standing, **options)
            fitted |= new
        elif patience is not None and now - changed >= patience + still:
            return batch
        time.sleep(min(_LOOK, max(still / 4, 0.02)))


def require_watchable(folder: Path) -> None:
    """Raise InputError for what is not a folder."""
    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder; give the one that the instrument writes to")


def _files(place: Path, pattern: str) -> dict[Path, _State]:
    """Return the files that may be measurements, by name, with size and time of the last change."""
    found: dict[Path, _State] = {}
    for path in sorted(place.iterdir()):
        if path.name.startswith(".") or path.suffix.lower() in _NOT_DATA or not fnmatch(path.name, pattern):
            continue
        try:
            state = path.stat()
        except OSError:  # it has just gone
            continue
        if path.is_file() and state.st_size:
            found[path] = state.st_size, state.st_mtime_ns
    return found

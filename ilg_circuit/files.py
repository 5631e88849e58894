"""Writing files so that a reader never sees half of one: replaced whole or not at all."""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import shutil
import stat
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import FileIO, StringIO
from pathlib import Path
from typing import Any

from .errors import IlgError, InputError, argument, one_line, visible

#: Files and folders that this process removes at its end, also if it is killed by a signal.
_temporaries: set[Path] = set()


def require_writable(path: Path) -> None:
    """Raise InputError for an output path that cannot be written, before the work is done."""
    try:
        there = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        there = None
    except (OSError, ValueError) as error:  # links in a circle, a name too long or with a null in it
        raise _unwritable(path, error) from None
    folder = (path.resolve() if path.is_symlink() else path).parent
    if there and stat.S_ISDIR(there.st_mode):
        raise InputError(f"cannot write '{path}': it is a folder; give a file name in it")
    if there and not stat.S_ISREG(there.st_mode):
        raise InputError(f"cannot write '{path}': it is a pipe or a device; give a file name")
    if there and not os.access(path, os.W_OK):
        raise InputError(f"cannot write '{path}': it is write-protected; choose another or change its mode")
    if not folder.is_dir():
        raise InputError(f"cannot write '{path}': folder '{folder}' does not exist; create it or choose another")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"cannot write '{path}': folder '{folder}' is not writable; choose another")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place when the block ends well and vanishes when it does not.

    The mode of a file that is replaced stays.
    """
    require_writable(path)
    target = path.resolve()  # through a link to the file that it stands for
    with temporary_path(target.with_name(f".ilg-{os.urandom(8).hex()}{target.suffix}")) as temporary:
        try:
            mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
            flags = os.O_CREAT | os.O_EXCL | os.O_WRONLY
            os.close(os.open(temporary, flags, 0o666 if mode is None else mode & 0o600))
            yield temporary
            if mode is not None:
                temporary.chmod(mode)
            temporary.replace(target)
        except OSError as error:
            raise _unwritable(path, error) from None


@contextmanager
def temporary_path(path: Path) -> Iterator[Path]:
    """Yield ``path``; what is there at the end of the block, or of the process, is removed."""
    _temporaries.add(path)
    try:
        yield path
    finally:
        _remove(path)
        _temporaries.discard(path)


def remove_temporaries() -> None:
    """Remove what is temporary, before the process is ended by force."""
    for path in list(_temporaries):
        _remove(path)


def remove_leftovers(folder: Path) -> None:
    """Remove what processes that were killed left half-written in a folder; no other may be writing to it."""
    for path in folder.glob(".ilg-*"):
        if re.fullmatch(r"\.ilg-[0-9a-f]{16}(\..*)?", path.name):
            _remove(path)


def _remove(path: Path) -> None:
    with suppress(OSError):
        path.unlink(missing_ok=True)
    shutil.rmtree(path, ignore_errors=True)


def _unwritable(path: Path, error: OSError | ValueError) -> InputError:
    return InputError(f"cannot write '{path}': {getattr(error, 'strerror', None) or error}")


@dataclass(frozen=True)
class FolderKind:
    """What marks a folder as made by this package: a file ``marker``, JSON with its ``files`` and ``inputs``.

    ``maker`` names in errors what made it.
    """

    marker: str
    maker: str


FIT = FolderKind(".ilg-fit.json", "a fit")
KIT = FolderKind(".ilg-kit.json", "the writer of a kit")
MARKER = FIT.marker
#: File in the folder of a fit where a later run failed.
OUTDATED = "OUTDATED.txt"


def marked(folder: Path, kind: FolderKind = FIT) -> dict[str, Any]:
    """Return the content of a folder's marker, empty if there is none."""
    try:
        content = json.loads((folder / kind.marker).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def require_folder(path: Path, *, force: bool = False, inputs: Iterable[Path] = (), kind: FolderKind = FIT) -> None:
    """Raise InputError for a folder of results that cannot be written, before the work is done.

    One that is there is replaced only if this package made it, as this ``kind``, and nothing was added, or by
    ``force``; never one with ``inputs`` or the working folder in it.
    """
    target = path.resolve()
    if not path.exists():
        require_writable(path)
        return
    if not path.is_dir():
        raise InputError(f"cannot make the folder '{path}': a file has that name; give another {argument('folder')}")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise InputError(f"cannot replace '{path}': its folder is not writable; give another {argument('folder')}")
    if Path.cwd().is_relative_to(target) or any(file.resolve().is_relative_to(target) for file in inputs):
        raise InputError(f"cannot replace '{path}': what is read, or the working folder, is in it; give another folder")
    there = {file.name for file in target.iterdir()}
    others = sorted(there - {kind.marker, *marked(target, kind).get("files", ())})
    if others and not force:
        told = "holds what was not written by" if kind.marker in there else "was not made by"
        raise InputError(
            f"'{path}' {told} {kind.maker} ({others[0]}); "
            f"give {argument('force')} to replace it, or another {argument('folder')}"
        )


@contextmanager
def outdated_by_failure(path: Path | None) -> Iterator[None]:
    """Mark a folder of results as an earlier run's, by the file `OUTDATED` in it, where the block ends in an error.

    The error's line then tells it. A folder that is not this package's stays as it is.
    """
    try:
        yield
    except IlgError as error:
        if path is None or not (marker := marked(path)):
            raise
        text = f"The last run made no fit: {error}\nThe other files in this folder are from an earlier run.\n"
        try:
            write_text(path / OUTDATED, text)
            files = sorted({*marker.get("files", ()), OUTDATED})
            write_json(path / MARKER, {**marker, "files": files, "key": ""})
        except (OSError, InputError):
            raise error from None
        error.args = (one_line(f"{error}; '{path}' is of an earlier run, see {OUTDATED} in it"),)
        raise


@contextmanager
def replacing_folder(
    path: Path, marker: Mapping[str, Any], *, force: bool = False, kind: FolderKind = FIT
) -> Iterator[Path]:
    """A temporary folder beside ``path`` that takes its place, with its ``marker``, when the block ends well.

    Raises InputError as `require_folder` does.
    """
    require_folder(path, force=force, kind=kind)
    target = path.resolve()
    with temporary_path(target.with_name(f".ilg-{os.urandom(8).hex()}")) as temporary:
        try:
            temporary.mkdir()
            yield temporary
            files = sorted(file.name for file in temporary.iterdir())
            write_json(temporary / kind.marker, {**marker, "files": files})
            if target.exists():
                _exchange(temporary, target)
            else:
                temporary.rename(target)
        except OSError as error:
            raise _unwritable(path, error) from None


def _exchange(made: Path, target: Path) -> None:
    """Replace a folder by another one, or leave both unchanged."""
    old = target.with_name(f"{made.name}.old")
    try:
        target.rename(old)
        made.rename(target)
    except BaseException:
        if old.exists() and not target.exists():
            old.rename(target)
        raise
    _remove(old)


class _PatientFile(FileIO):
    """A file for HDF5, which does not survive a write that fails: a failure is kept, and what follows is dropped."""

    failure: BaseException | None = None

    def write(self, data: Any) -> int:
        whole = left = memoryview(data).cast("B")
        if self.failure is None:
            try:
                while left:
                    left = left[super().write(left) :]
            except BaseException as error:  # also an interrupt, which could not pass through HDF5
                self.failure = error
        return len(whole)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0


@contextmanager
def writing_netcdf(path: Path) -> Iterator[Any]:
    """An h5netcdf file, open for writing, that takes the place of ``path`` as in `replacing`."""
    import h5netcdf

    with replacing(path) as temporary, _PatientFile(temporary, "r+") as file:
        try:
            with h5netcdf.File(file, "w") as made:
                yield made
        except Exception:  # HDF5 raises various errors after the disk's own, which is raised below
            if file.failure is None:
                raise
        if file.failure is not None:
            raise file.failure


@contextmanager
def locked(path: Path, taken: str) -> Iterator[None]:
    """Hold a file that stands for a place, made if absent with its folder, for this process alone.

    The file goes at the end of the block; one that a dead process left is not a lock. Raises InputError, which says
    ``taken``, where another process holds it.
    """
    try:
        handle = _own(path, taken)
    except OSError as error:
        raise _unwritable(path, error) from None
    try:
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _own(path: Path, taken: str) -> int:
    """Return the open handle of a locked file."""
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(path, os.O_CREAT | os.O_RDWR)
        except FileNotFoundError:  # its holder has just removed the folder
            continue
        try:
            if sys.platform == "win32":
                import msvcrt

                msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.path.exists(path) and os.path.samestat(os.fstat(handle), os.stat(path)):
                return handle
        except (BlockingIOError, PermissionError):
            os.close(handle)
            raise InputError(taken) from None
        except OSError as error:
            if error.errno in (errno.ENOLCK, errno.ENOTSUP):  # a file system without locks
                return handle
            os.close(handle)
            raise
        os.close(handle)  # its holder has just removed it


def read_bytes(path: str | Path, most: int, what: str) -> bytes:
    """Return what is in a file, or in a pipe that something writes to: ``most`` bytes or less of a ``what``.

    Raises
    ------
    InputError
        It cannot be read, is larger, or is a device or a pipe without a writer: nothing is waited for.
    """
    parts: list[bytes] = []
    try:
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(path, flags), "rb", buffering=0) as file:
            status, left = os.fstat(file.fileno()), most + 1
            if stat.S_ISFIFO(status.st_mode):
                first = file.read(1)  # None: nothing has been written yet
                if first == b"":
                    raise InputError(f"cannot read '{path}': it is a pipe that nothing is written to; give a file")
                if first:
                    parts, left = [first], most
                os.set_blocking(file.fileno(), True)
            elif not stat.S_ISREG(status.st_mode):
                raise InputError(f"cannot read '{path}': it is a folder or a device; give a file")
            room = status.st_size + 1 if status.st_size else 1 << 24  # made at once
            while part := file.read(min(left, room)):
                parts.append(part)
                left -= len(part)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot read '{path}': {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"cannot read '{path}': no such file") from None  # a null in its name
    if not left:
        raise InputError(f"{visible(Path(path).name)}: larger than {most / 1e6:g} MB; that is no {what}")
    return b"".join(parts)


def write_text(path: Path, text: str) -> None:
    """Write ``text`` as UTF-8 with ``\\n`` line ends, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write ``content`` as JSON, whole or not at all; a number that is not finite raises ValueError."""
    write_text(Path(path), json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_csv(path: str | Path, columns: Mapping[str, Iterable[Any]]) -> None:
    """Write `csv_text` of ``columns``, whole or not at all."""
    write_text(Path(path), csv_text(columns))


def csv_text(columns: Mapping[str, Iterable[Any]]) -> str:
    """Return ``columns`` (header -> numbers or words, all of one length) as CSV.

    Numbers have all their digits, so that reading gives them back to the last bit; NaN and None are blank.
    """
    import numpy as np

    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    lists = [column.tolist() if isinstance(column, np.ndarray) else list(column) for column in columns.values()]
    writer.writerows([None if cell != cell else cell for cell in row] for row in zip(*lists, strict=True))
    return text.getvalue()


class Log:
    """A file to which lines are appended: time, subject, outcome."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        require_writable(self.path)

    def __call__(self, subject: str, outcome: str) -> None:
        """Append a line, whole. Raises InputError where it cannot be written."""
        from datetime import datetime

        now = datetime.now().astimezone().isoformat(timespec="seconds")
        line = f"{now} {visible(subject)}: {visible(outcome)}\n"
        try:
            with self.path.open("ab", buffering=0) as file:
                file.write(line.encode("utf-8", "backslashreplace"))
        except OSError as error:
            raise _unwritable(self.path, error) from None

"""Writing files so that a reader never sees half of one: replaced whole or not at all."""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from typing import Any

from .errors import InputError


def require_writable(path: Path) -> None:
    """Refuse an output path before the work is done, not after: InputError says what is wrong with it."""
    folder = path.parent
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(f"cannot write '{path}': it is a pipe or a device; give a file name")
    if path.is_dir():
        raise InputError(f"cannot write '{path}': it is a folder; give a file name in it")
    if not folder.is_dir():
        raise InputError(f"cannot write '{path}': folder '{folder}' does not exist; create it or choose another")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"cannot write '{path}': folder '{folder}' is not writable; choose another")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside ``path`` that takes its place when the block ends well and vanishes when it does not."""
    require_writable(path)
    path = path.resolve()  # through a link to the file that it stands for
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    except OSError as error:
        raise InputError(f"cannot write '{path}': {error.strerror or error}") from None
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"cannot write '{path}': {error.strerror or error}") from None
    finally:
        with suppress(OSError):
            temporary.unlink()


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


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask

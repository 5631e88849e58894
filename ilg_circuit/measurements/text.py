"""Text as instruments and their programs write it: any of the usual encodings, with or without a mark."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError, visible
from ..files import read_bytes
from .kind import Kind


@dataclass(frozen=True)
class TextFile:
    """A file that was read: its ``name``, its ``lines`` without line ends, its ``size`` [bytes]."""

    name: str
    lines: list[str]
    size: int


@dataclass(frozen=True)
class RawFile:
    """The bytes of a file, as they are, and its ``name``."""

    name: str
    raw: bytes


def read_raw(path: str | Path, kind: Kind) -> RawFile:
    """Read a file that should hold a ``kind``.

    Raises
    ------
    InputError
        The file cannot be read, or is larger than ``kind.most_bytes``.
    """
    return RawFile(visible(Path(path).name), read_bytes(path, kind.most_bytes, kind.name))


def text_of(file: RawFile, kind: Kind) -> TextFile:
    """Return the lines of a file. Raises InputError for a file that is not text."""
    text = decoded(file.raw)
    if "\0" in text:
        raise InputError(f"{file.name}: not a text file; export the {kind.name} as text (CSV)")
    return TextFile(file.name, text.rstrip("\x1a").splitlines(), len(file.raw))


def decoded(raw: bytes) -> str:
    """Return text in the encoding that its first bytes show: UTF-16, UTF-8, or else Latin-1."""
    begin = raw[:64]
    for name, letters, zeros in (("utf-16-le", begin[::2], begin[1::2]), ("utf-16-be", begin[1::2], begin[::2])):
        if len(begin) > 8 and not any(zeros) and all(letters):
            return raw.decode(name, errors="replace")  # without a mark
    if begin[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.removeprefix(b"\xef\xbb\xbf").decode("latin-1")  # instruments write the micro sign so

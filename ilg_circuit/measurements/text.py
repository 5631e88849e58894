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


def read_lines(path: str | Path, kind: Kind) -> TextFile:
    """Read the text of a file that should hold a ``kind``.

    Raises
    ------
    InputError
        The file cannot be read, is larger than ``kind.most_bytes``, or is no text.
    """
    name = visible(Path(path).name)
    raw = read_bytes(path, kind.most_bytes, kind.name)
    text = _decoded(raw)
    if "\0" in text:
        raise InputError(f"{name}: not a text file; export the {kind.name} as text (CSV)")
    return TextFile(name, text.rstrip("\x1a").splitlines(), len(raw))


def _decoded(raw: bytes) -> str:
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

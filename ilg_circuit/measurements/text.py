"""Text as instruments and their programs write it: any of the usual encodings, with or without a mark."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError, visible
from ..files import read_bytes
from .kind import Kind

#: Number of bytes from which an encoding is detected; fractions of zeros among every second byte in UTF-16.
_BEGIN, _ZEROS, _NO_ZEROS = 20_000, 0.5, 0.02
#: Encodings of East Asia, and words of columns by which one of them is detected.
_ASIAN = ("cp932", "gb18030", "euc_jp", "euc_kr", "big5")
_WORDS = (
    *("時間", "電圧", "電流", "変位", "電位", "周波数", "荷重", "応力", "ひずみ", "経過"),
    *("时间", "電壓", "电压", "电流", "位移", "频率", "载荷", "應力", "应力", "時間", "頻率"),
    *("시간", "전압", "전류", "변위", "주파수", "하중"),
)


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
    """Return text in the encoding that its first bytes show: UTF-16, UTF-8, one of East Asia, or else Latin-1."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    begin = raw[:_BEGIN]
    for name, letters, zeros in (("utf-16-le", begin[::2], begin[1::2]), ("utf-16-be", begin[1::2], begin[::2])):
        even = zeros.count(0) >= _ZEROS * len(zeros) and letters.count(0) <= _NO_ZEROS * len(letters)
        if len(begin) > 8 and even:
            return raw.decode(name, errors="replace")  # without a mark
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raw = raw.removeprefix(b"\xef\xbb\xbf")
        return raw.decode(_asian(begin) or "latin-1", errors="replace")  # instruments write the micro sign so


def _asian(begin: bytes) -> str | None:
    """Return the encoding of East Asia in which a text's beginning has words of columns, None where it is in none."""
    whole = begin[: begin.rfind(b"\n") + 1] or begin
    for name in _ASIAN:
        try:
            text = whole.decode(name)
        except UnicodeDecodeError:
            continue
        if any(word in text for word in _WORDS):
            return name
    return None

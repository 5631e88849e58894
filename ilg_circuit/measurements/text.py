"""Text as instruments and their programs write it: any of the usual encodings, with or without a mark."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError


def read_text(path: str | Path, most_bytes: int, what: str) -> str:
    """The text of a file of at most ``most_bytes`` that should hold a ``what``, such as "spectrum".

    Raises InputError for a file that cannot be read, is larger, or is no text.
    """
    try:
        with Path(path).open("rb") as file:
            raw = file.read(most_bytes + 1)
    except OSError as error:
        raise InputError(f"cannot read '{path}': {error.strerror or error}") from None
    except ValueError:
        raise InputError(f"cannot read '{path}': no such file") from None
    name = Path(path).name
    if len(raw) > most_bytes:
        raise InputError(f"{name}: larger than {most_bytes // 1_000_000} MB; that is no {what}")
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = raw.decode("utf-16", errors="replace")
    else:
        try:
            text = raw.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = raw.decode("latin-1")  # instruments write the micro sign so
    if "\0" in text:
        raise InputError(f"{name}: not a text file; export the {what} as text (CSV)")
    return text

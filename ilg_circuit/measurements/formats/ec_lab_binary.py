"""EC-Lab's binary files (.mpr), read by galvani: the columns of its text exports."""

from __future__ import annotations

import io

from ...errors import InputError
from ...extras import require_reader
from ..said import Said

NAME = "EC-Lab mpr"


def opens(raw: bytes) -> bool:
    """Return True if the bytes of a file begin as EC-Lab's do."""
    return raw.startswith(b"BIO-LOGIC MODULAR FILE")


def lines(raw: bytes, name: str, said: Said) -> tuple[list[str], Said]:
    """Return the table as EC-Lab exports it, tabs between its cells.

    Raises
    ------
    MissingLibraryError
        galvani is not installed.
    InputError
        The file is damaged, or of a version that galvani does not support.
    """
    require_reader("galvani", f"{name}: EC-Lab's .mpr")
    from galvani.BioLogic import MPRfile

    try:
        data = MPRfile(io.BytesIO(raw)).data
    except Exception as error:  # it asserts, unpacks and indexes what it reads
        raise InputError(
            f"{name}: galvani cannot read this .mpr ({type(error).__name__}); export it from EC-Lab as text (.mpt)"
        ) from None
    titles = [str(title) for title in data.dtype.names]
    rows = ["\t".join(map(repr, row)) for row in zip(*(data[title].tolist() for title in titles), strict=True)]
    return ["\t".join(titles), *rows], said

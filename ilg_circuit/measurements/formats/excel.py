"""Excel's workbooks (.xlsx), read by openpyxl: every sheet is a table as of a text file."""

from __future__ import annotations

import io
import warnings
import zipfile
from dataclasses import replace

from ...errors import InputError
from ...extras import require_reader
from ..said import Said, pick
from . import csv

NAME = "Excel"

#: Largest size of an unpacked workbook.
_MOST_BYTES = 300_000_000
_MOST_COLUMNS = 1000


def opens(raw: bytes) -> bool:
    """Return True if the bytes of a file are a workbook."""
    return raw.startswith(b"PK\x03\x04") and b"xl/" in raw


def lines(raw: bytes, name: str, said: Said) -> tuple[list[str], Said]:
    """Return the rows of the sheet that is meant, tabs between their cells.

    Raises
    ------
    MissingLibraryError
        openpyxl is not installed.
    InputError
        The file is damaged or too large, or several sheets hold a table and none was chosen.
    """
    require_reader("openpyxl", f"{name}: an Excel workbook")
    from openpyxl import load_workbook

    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > _MOST_BYTES:
            raise InputError(f"{name}: larger than {_MOST_BYTES // 1_000_000} MB unpacked; export the sheet as CSV")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and extensions that are not read
            book = load_workbook(io.BytesIO(raw), read_only=True, data_only=True)
            sheets = [
                (sheet.title, ["\t".join(map(_text, row[:_MOST_COLUMNS])) for row in sheet.iter_rows(values_only=True)])
                for sheet in book.worksheets
            ]
    except InputError:
        raise
    except Exception as error:  # a damaged workbook fails in zip, in XML or in a cell
        raise InputError(
            f"{name}: openpyxl cannot read this workbook ({type(error).__name__}); save the sheet as CSV"
        ) from None
    filled = [(title, rows) for title, rows in sheets if any(row.strip() for row in rows)]
    if not filled:
        raise InputError(f"{name}: no sheet has anything in it")
    tables = [(title, rows) for title, rows in filled if csv.holds_table(rows, said)] or filled[:1]
    if len(tables) == 1:
        return tables[0][1], said
    return pick(tables, said, name), replace(said, part=None)


def _text(cell: object) -> str:
    """Return a cell as text without tabs and line ends, a number with all its digits."""
    if cell is None:
        return ""
    return repr(cell) if isinstance(cell, float) else " ".join(str(cell).split())

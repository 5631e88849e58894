"""File formats, one a module, in the order in which a file is offered to them.

To add one, write a module with `NAME`, `KINDS`, `recognises` and `read` (the protocol `Format`) and put it into
`FORMATS`; a binary one has `NAME`, `opens` and `lines` (the protocol `Binary`) and stands in `BINARIES`. The last of
`FORMATS`, `csv`, takes all files that no other format recognises; its errors say what a file needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from ..kind import Kind
from ..said import Said
from ..table import Table
from . import (
    bare,
    chi,
    csv,
    deeplabcut,
    ec_lab,
    ec_lab_binary,
    elchemea,
    excel,
    gamry,
    ivium,
    kinovea,
    lvm,
    oscilloscope,
    pssession,
    tracker,
    versastudio,
    wrdata,
    zplot,
)


class Format(Protocol):
    """The interface of a file format's module: its ``NAME``, and the ``KINDS`` of data that its files may hold."""

    NAME: str
    KINDS: tuple[Kind, ...]

    def recognises(self, lines: Sequence[str]) -> Kind | None:
        """Return the kind of data in a file of this format, None for a file of another."""

    def read(self, lines: Sequence[str], name: str, kind: Kind) -> Table:
        """Return the columns of a ``kind`` in SI units; InputError, naming line and column, for what cannot be read."""


class Binary(Protocol):
    """The interface of a binary format's module, which turns a file's bytes into lines that one of `FORMATS` reads."""

    def opens(self, raw: bytes) -> bool:
        """Return True if the bytes of a file are of this format."""

    NAME: str

    def lines(self, raw: bytes, name: str, said: Said) -> tuple[list[str], Said]:
        """Return lines, and ``said`` without the statements applied; MissingLibraryError if its reader is missing."""


FORMATS: tuple[Format, ...] = (
    *(pssession, gamry, zplot, versastudio, lvm, wrdata, oscilloscope, chi, ec_lab),
    *(deeplabcut, kinovea, tracker, elchemea, bare, csv),
)
BINARIES: tuple[Binary, ...] = (ec_lab_binary, ivium, excel)

"""Aligned text tables for a terminal."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]], alignment: str, *, indent: str = "", gap: int = 2) -> list[str]:
    """Return ``rows`` as lines with aligned columns, ``gap`` blanks apart.

    ``alignment`` has a character a column: ``<`` for words, ``>`` for numbers. Every column is as wide as its widest
    cell. The last cell of a row that is shorter than ``alignment`` may run on over the columns that it leaves out.
    """
    full = [row if len(row) == len(alignment) else row[:-1] for row in rows]
    widths = [max((len(row[k]) for row in full if k < len(row)), default=0) for k in range(len(alignment))]
    lines = []
    for row, measured in zip(rows, full, strict=True):
        cells = [f"{cell:{side}{width}}" for cell, side, width in zip(measured, alignment, widths, strict=False)]
        lines.append((indent + (gap * " ").join([*cells, *row[len(measured) :]])).rstrip())
    return lines

"""Ivium's data files (.idf): text with zeros before it, and tables of three columns below the word primary_data."""

from __future__ import annotations

from dataclasses import replace

from ...errors import InputError
from ..said import Said, pick

NAME = "Ivium"


def opens(raw: bytes) -> bool:
    """Return True if the bytes of a file have Ivium's table."""
    return b"primary_data" in raw and b"Version=" in raw[:4000]


def lines(raw: bytes, name: str, said: Said) -> tuple[list[str], Said]:
    """Return the table that is meant: time, current and potential, or Re Z, -Im Z and frequency.

    Raises
    ------
    InputError
        There is no table of three columns, or several and none was chosen.
    """
    text = raw.decode("latin-1").replace("\0", "").splitlines()
    starts = [k for k, line in enumerate(text) if line.strip().endswith("primary_data")]
    impedance = any(line.strip().lower() == "method=impedance" for line in text)
    header = "re_ohm\tminus_im_ohm\tfrequency_Hz" if impedance else "time_s\tcurrent_A\tvoltage_V"
    parts = []
    for start in starts:
        if [word.strip() for word in text[start + 1 : start + 2]] != ["3"] or not text[start + 2 : start + 3]:
            continue
        count = text[start + 2].strip()
        rows = text[start + 3 : start + 3 + (int(count) if count.isdecimal() and len(count) < 10 else 0)]
        parts.append((f"{len(rows)} rows below line {start + 1}", ["\t".join(row.split()) for row in rows]))
    if not parts:
        raise InputError(f"{name}: an Ivium file without a table of three columns; export the data as CSV")
    return [header, *pick(parts, said, name)], replace(said, part=None)

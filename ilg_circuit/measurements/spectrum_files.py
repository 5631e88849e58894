"""Impedance spectra from files: our own CSV and what instruments export, made ready for a fit.

What a file is, its content tells: Gamry's .DTA by its ZCURVE table, ZPlot's .z by its first line, a table (ours,
EC-Lab's export) by a column of frequencies, bare numbers as frequency, Re Z, Im Z. Im Z is negative for a capacitor;
columns called -Im(Z) or -Z'' are turned round.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import ComplexArray
from ..errors import InputError
from ..units import format_quantity
from .prepare import noise_level
from .record_files import gamry_rows, is_gamry, is_gamry_record
from .table import Quantities, parse_table
from .text import read_text

Array = NDArray[np.float64]

SPECTRUM_QUANTITIES: Quantities = {
    "frequency": ("Hz", ("frequency", "freq", "f")),
    "re": ("ohm", ("re", "re(z)", "z_re", "zre", "zreal", "z_real", "real", "z'", "z'(a)")),
    "im": ("ohm", ("im", "im(z)", "z_im", "zim", "zimag", "z_imag", "imag", "z''", "z''(b)", 'z"')),
    "minus_im": ("ohm", ("-im", "-im(z)", "minus_im", "-z_im", "-zim", "-zimag", "-z''", '-z"', "-imag")),
}
EXAMPLE = "frequency_Hz, re_ohm, im_ohm"

_MOST_BYTES = 5_000_000
_MOST_POINTS, _MOST_LINES = 20_000, 100_000
_FEWEST_POINTS = 6
#: The header of a table is looked for in so many lines.
_PREAMBLE = 400
#: Im Z above this part of abs(Z) at the upper end is an inductance's, not noise about zero.
_INDUCTIVE = 1e-3
#: Frequencies closer than this, relatively, are one.
_SAME = 1e-6
_LARGEST, _SMALLEST = 1e15, 1e-15
_OHM = re.compile(r"ohms?\b|[\u03a9\u2126]", re.IGNORECASE)
_FREQUENCY = re.compile(r"\s*\"?\s*(?:frequency|freq|f)\s*(?:_|\[|\(|/)\s*[kmMG]?Hz", re.IGNORECASE)
_RECORD = re.compile(r"voltage|potential|(^|[,;\t])\s*t(ime)?\s*[_/\[(]", re.IGNORECASE)
_REAL_PART = re.compile(r"(^|[^a-z])(z_?)?re(al)?([^a-z]|$)|z'", re.IGNORECASE)


@dataclass(frozen=True)
class Spectrum:
    """``impedance`` [ohm] (f,) at ``frequency`` [Hz] (f,), ascending; ``notes`` tell what was dropped, and why."""

    source: str
    frequency: Array
    impedance: ComplexArray
    notes: tuple[str, ...] = field(default=())

    @property
    def modulus(self) -> Array:
        """abs(Z) [ohm]."""
        return np.asarray(np.abs(self.impedance))

    def without(self, points: NDArray[np.bool_]) -> Spectrum:
        """The same without some ``points`` (f,)."""
        return Spectrum(self.source, self.frequency[~points], self.impedance[~points], self.notes)


def read_spectrum(path: str | Path) -> Spectrum:
    """Read and prepare a spectrum; see the module for the formats and `prepare_spectrum` for what is dropped.

    Raises InputError, naming file and line where it can, for whatever holds no spectrum.
    """
    name = Path(path).name
    text = read_text(path, _MOST_BYTES, "spectrum")
    frequency, z = _numbers(text, name)
    return prepare_spectrum(frequency, z, name)


def is_spectrum(path: str | Path) -> bool:
    """Whether a file holds a spectrum rather than a record over time; False for what cannot be read."""
    try:
        text = read_text(path, _MOST_BYTES, "spectrum")
    except InputError:
        return False
    whole = text.splitlines()
    lines = whole[:_PREAMBLE]
    if is_gamry(whole) or _is_zplot(lines):
        return not is_gamry_record(whole)
    start = _header(lines)
    if start is not None:  # a record over time may have a column of the drive's frequency
        return not _RECORD.search(lines[start]) or bool(_REAL_PART.search(lines[start]))
    titles = next((line for line in lines if line.strip()), "")
    if _bare(titles) is None and _RECORD.search(titles):
        return False
    rows = [row for row in (_bare(line) for line in lines if line.strip()) if row is not None]
    if len(rows) < _FEWEST_POINTS or len(rows) < 0.9 * sum(bool(line.strip()) for line in lines):
        return False
    # a record's times are even and begin at zero, a sweep's frequencies are even in logarithm
    f = np.array([row[0] for row in rows])
    if not (np.isfinite(f).all() and (f > 0).all() and f.max() > 10 * f.min()):
        return False
    steps = np.diff(f)
    return bool(((steps > 0).all() or (steps < 0).all()) and np.abs(steps).max() > 3 * np.abs(steps).min())


def prepare_spectrum(frequency: ArrayLike, impedance: ArrayLike, source: str = "spectrum") -> Spectrum:
    """Sort by ``frequency`` [Hz] and drop what is no reading of ``impedance`` [ohm].

    That is: blanks, frequencies that are not positive, drop-outs (zero, or beyond all measure), repeated frequencies,
    and the inductive end: the highest frequencies, as far down as Im Z is clearly positive. Raises InputError where
    fewer than six points are left.
    """
    f, z = np.asarray(frequency, dtype=float), np.asarray(impedance, dtype=complex)
    if f.ndim != 1 or f.shape != z.shape:
        raise InputError(f"{source}: frequencies of shape {f.shape} and impedances of shape {z.shape} are no spectrum")
    if len(f) > _MOST_POINTS:
        raise InputError(f"{source}: {len(f)} points; a spectrum has {_MOST_POINTS} at most")
    notes: list[str] = []

    def drop(bad: NDArray[np.bool_], why: str) -> None:
        nonlocal f, z
        if bad.any():
            notes.append(f"{_counted(int(bad.sum()))} {why}: left out")
            f, z = f[~bad], z[~bad]

    drop(~(np.isfinite(f) & np.isfinite(z)), "without a number")
    drop(~((f > _SMALLEST) & (f < _LARGEST)), "whose frequency is not positive (or beyond all measure)")
    with np.errstate(over="ignore"):
        size = np.abs(z)
    drop(~((size > _SMALLEST) & (size < _LARGEST)), "with no sensible reading (a drop-out)")
    order = np.argsort(f, kind="stable")
    f, z = f[order], z[order]
    again = np.zeros(len(f), dtype=bool)
    again[1:] = np.diff(f) <= _SAME * f[1:]
    drop(again, "at a frequency that was there before (the first reading is kept)")
    inductive = _inductive(z)
    if inductive.sum() > 0.8 * len(f) > 0 or _turned(z[~inductive]):
        raise InputError(
            f"{source}: Im Z is positive over most of the band; a capacitor's is negative: if the column holds -Im Z, "
            "call it minus_im_ohm"
        )
    if inductive.any():
        least = format_quantity(float(f[inductive][0]), "Hz", 4)
        drop(inductive, f"from {least} on, where Im Z is positive (the leads' inductance)")
    if len(f) < _FEWEST_POINTS:
        told = f" ({'; '.join(notes)})" if notes else ""
        raise InputError(f"{source}: {_counted(len(f))} left, {_FEWEST_POINTS} are needed{told}")
    if (z.real < 0).any():
        notes.append(f"{_counted(int((z.real < 0).sum()))} with Re Z below zero, which no passive strip has")
    return Spectrum(source, f, z, tuple(notes))


def _inductive(z: ComplexArray) -> NDArray[np.bool_]:
    """The points of the upper end where Im Z is positive beyond noise."""
    if not len(z):
        return np.zeros(0, dtype=bool)
    part = z.imag / np.abs(z)
    positive = part > max(_INDUCTIVE, 4 * noise_level(part))
    run = len(z) - int(np.argmin(positive[::-1])) if not positive.all() else 0
    return np.arange(len(z)) >= run


def _turned(z: ComplexArray) -> bool:
    """Whether Im Z, apart from noise about zero, is positive rather than negative."""
    part = z.imag / np.abs(z)
    above, below = float(part[part > 0].sum()), -float(part[part < 0].sum())
    return above > max(2 * below, 0.01 * len(z))


def _counted(count: int) -> str:
    return f"{count} point{'s' * (count != 1)}"


def _numbers(text: str, name: str) -> tuple[Array, ComplexArray]:
    """Frequency [Hz] and impedance [ohm] of the file, in its order, NaN for blanks."""
    lines = text.splitlines()
    if len(lines) > _MOST_LINES:
        raise InputError(f"{name}: {len(lines)} lines; that is no spectrum")
    if not any(line.strip() for line in lines):
        raise InputError(f"{name}: the file is empty; a spectrum has columns such as {EXAMPLE}")
    if is_gamry(lines):
        return _gamry(lines, name)
    if _is_zplot(lines):
        return _zplot(lines, name)
    start = _header(lines[:_PREAMBLE])
    if start is not None:
        return _table(lines, start, name)
    return _headerless(lines, name)


def _is_zplot(lines: list[str]) -> bool:
    return bool(lines) and lines[0].lstrip('\ufeff" ').lower().startswith("zplot")


def _header(lines: list[str]) -> int | None:
    """The line that names the columns, one of them a frequency."""
    for k, line in enumerate(lines):
        if len(line) < 10_000 and any(_FREQUENCY.match(cell) for cell in re.split(r"[,;\t]|\s{2,}", line)):
            return k
    return None


def _table(lines: list[str], start: int, name: str) -> tuple[Array, ComplexArray]:
    if len(lines) - start > 2 * _MOST_POINTS:
        raise InputError(f"{name}: {len(lines) - start} rows; a spectrum has {_MOST_POINTS} at most")
    header = _OHM.sub("ohm", lines[start])
    # blank lines in place of the preamble: errors then count the file's own lines
    text = "\n".join([""] * start + [header] + lines[start + 1 :])
    table = parse_table(text, name, ("frequency", "re"), quantities=SPECTRUM_QUANTITIES, example=EXAMPLE)
    plus, minus = table.columns.get("im"), table.columns.get("minus_im")
    if plus is None and minus is None:
        raise InputError(f"{name}: no column for the imaginary part; columns are written like {EXAMPLE}")
    if plus is not None and minus is not None:
        raise InputError(f"{name}: columns for both Im Z and -Im Z; leave one out")
    im = plus if plus is not None else -minus if minus is not None else np.empty(0)
    return table.columns["frequency"], _complex(table.columns["re"], im)


def _gamry(lines: list[str], name: str) -> tuple[Array, ComplexArray]:
    start = next((k for k, line in enumerate(lines) if re.match(r"ZCURVE\s+TABLE", line)), None)
    if start is None or start + 3 > len(lines):
        raise InputError(f"{name}: a Gamry file without a ZCURVE table: it holds no impedance spectrum")
    header = [cell.strip().lower() for cell in lines[start + 1].split("\t")]
    places = _places(header, {"freq": "Freq", "zreal": "Zreal", "zimag": "Zimag"}, name)
    return _picked(gamry_rows(lines, start), places, name)


def _zplot(lines: list[str], name: str) -> tuple[Array, ComplexArray]:
    start = next((k for k, line in enumerate(lines) if "freq(hz)" in line.lower()), None)
    if start is None:
        raise InputError(f"{name}: a ZPlot file without a row of names (Freq(Hz) ... Z'(a) Z''(b))")
    header = [cell.lower() for cell in lines[start].replace('"', " ").split()]
    places = _places(header, {"freq(hz)": "Freq(Hz)", "z'(a)": "Z'(a)", "z''(b)": "Z''(b)"}, name)
    rows = [
        (k + 1, re.split(r"\s*[,\t]\s*|\s+", lines[k].strip()))
        for k in range(start + 1, len(lines))
        if lines[k].strip() and "end comments" not in lines[k].lower()
    ]
    return _picked(rows, places, name)


def _places(header: list[str], wanted: dict[str, str], name: str) -> list[int]:
    missing = [title for key, title in wanted.items() if key not in header]
    if missing:
        raise InputError(f"{name}: no column {missing[0]} in its table of impedances")
    return [header.index(key) for key in wanted]


def _picked(rows: list[tuple[int, list[str]]], places: list[int], name: str) -> tuple[Array, ComplexArray]:
    """Three columns of split rows as frequency and impedance."""
    if not rows:
        raise InputError(f"{name}: its table of impedances has no rows")
    if len(rows) > _MOST_POINTS:
        raise InputError(f"{name}: {len(rows)} points; a spectrum has {_MOST_POINTS} at most")
    values = np.full((len(rows), 3), np.nan)
    for k, (number, cells) in enumerate(rows):
        for j, place in enumerate(places):
            cell = cells[place].strip() if place < len(cells) else ""
            if cell:
                values[k, j] = _number(cell, name, number)
    return values[:, 0], _complex(values[:, 1], values[:, 2])


def _headerless(lines: list[str], name: str) -> tuple[Array, ComplexArray]:
    rows: list[tuple[float, float, float]] = []
    for k, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        row = _bare(line)
        if row is None:
            if rows:
                raise InputError(f"{name}: line {k}: '{line.strip()[:40]}' is not frequency, Re Z, Im Z")
            raise InputError(f"{name}: no column for frequency; columns are written like {EXAMPLE}")
        rows.append(row)
        if len(rows) > _MOST_POINTS:
            raise InputError(f"{name}: more than {_MOST_POINTS} points; that is no spectrum")
    if not rows:
        raise InputError(f"{name}: no rows of numbers; a spectrum has columns such as {EXAMPLE}")
    values = np.array(rows)
    return values[:, 0], _complex(values[:, 1], values[:, 2])


def _bare(line: str) -> tuple[float, float, float] | None:
    """The first three numbers of a line of numbers, or None."""
    if len(line) > 10_000:
        return None
    if ";" in line or "\t" in line:
        cells = [cell.replace(",", ".") for cell in re.split(r"\s*[;\t]\s*", line.strip())]
    else:
        cells = re.split(r"\s*,\s*|\s+", line.strip())
    try:
        a, b, c, *_ = (float(cell) if "_" not in cell else float("x") for cell in cells if cell)
    except ValueError:
        return None
    return a, b, c


def _complex(real: Array, imaginary: Array) -> ComplexArray:
    """re + i im, infinite parts included."""
    z = np.empty(len(real), dtype=complex)
    z.real, z.imag = real, imaginary
    return z


def _number(cell: str, name: str, line: int) -> float:
    try:
        return float(cell.replace(",", ".").replace("_", "x"))
    except ValueError:
        raise InputError(f"{name}: line {line}: '{cell[:40]}' is not a number") from None

"""Impedance spectra, ready for a fit: sorted, without drop-outs and without the inductive end."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray, Mask, plain
from ..errors import InputError
from ..findings import Finding, sentences
from ..result import Column, Result
from .kind import SPECTRUM
from .said import options
from .smoothing import noise_level
from .table import Headers, Table

_FEWEST_POINTS = 6
#: Im Z / abs(Z) at the upper end above which Im Z is an inductance's, not noise about zero.
_INDUCTIVE = 1e-3
#: The same where there are too few points to estimate the noise, and how many these are.
_INDUCTIVE_OF_FEW, _FEW = 0.03, 16
#: Relative difference below which two frequencies are the same.
_SAME = 1e-6
_LARGEST, _SMALLEST = 1e15, 1e-15


@dataclass(frozen=True, repr=False, eq=False)
class Spectrum(Result):
    """A measured impedance over frequency, as `ilg_circuit.read` returns it.

    Attributes
    ----------
    source : str
        Name of the file or of the data.
    frequency : ndarray (f,)
        Frequencies [Hz], ascending.
    impedance : ndarray (f,), complex
        Impedance [ohm].
    notes : tuple of Finding
        Findings on points that were left out or are doubtful.
    headers : Headers
        Column and unit of each quantity in the file.
    """

    presenter: ClassVar[str] = "measured"

    source: str
    frequency: Array
    impedance: ComplexArray
    notes: tuple[Finding, ...] = ()
    headers: Headers = field(default_factory=dict)

    @property
    def modulus(self) -> Array:
        """abs(Z) [ohm]."""
        return np.abs(self.impedance)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The notes as sentences."""
        return sentences(self.notes)

    def table(self) -> tuple[Column, ...]:
        """Return frequency [Hz], real and imaginary part [ohm] (f,)."""
        parts = (Column("re", self.impedance.real, "ohm"), Column("im", self.impedance.imag, "ohm"))
        return (Column("frequency", self.frequency, "Hz", over=True), *parts)

    def to_dict(self) -> dict[str, Any]:
        """Return the spectrum as plain data, lists by header."""
        readings = {header: plain(values) for header, values in self.columns().items()}
        return {"source": self.source, "readings": readings, "warnings": list(self.warnings)}

    def without(self, points: Mask) -> Spectrum:
        """Return the spectrum without some of its points.

        Parameters
        ----------
        points : ndarray (f,), bool
            True for the points to leave out.

        Returns
        -------
        Spectrum
            The remaining points.
        """
        return replace(self, frequency=self.frequency[~points], impedance=self.impedance[~points])


def spectrum_of(table: Table) -> Spectrum:
    """Return the spectrum in the columns ``frequency`` [Hz], ``re`` and ``im`` [ohm] of a table.

    Raises
    ------
    InputError
        As `prepare_spectrum`.
    """
    z = np.empty(len(table.columns["re"]), dtype=complex)
    z.real, z.imag = table.columns["re"], table.columns["im"]
    title, unit = table.headers.get("im", ("", ""))
    turned = any(angle in unit.lower() for angle in ("deg", "rad", "\u00b0"))
    quantity = "minus_phase" if turned else "minus_im_y" if "S" in unit else "minus_im"
    said = f", or say so: {options(('columns', quantity, title))}" if title else ""
    found = prepare_spectrum(table.columns["frequency"], z, table.source, said)
    return replace(found, notes=(*table.notes, *found.notes), headers=table.headers)


def prepare_spectrum(
    frequency: ArrayLike, impedance: ArrayLike, source: str = "spectrum", advice: str = ""
) -> Spectrum:
    """Return the spectrum sorted by ``frequency`` (f,) [Hz], without invalid readings of ``impedance`` (f,) [ohm].

    Dropped are blanks, frequencies that are not positive, drop-outs (zero or huge), repeated frequencies, and the
    inductive end: the highest frequencies, down to where Im Z is no longer clearly positive. ``advice`` is added to the
    error for a wrong sign.

    Raises
    ------
    InputError
        Fewer than six points remain, there are too many, or Im Z has the wrong sign.
    """
    f, z = np.asarray(frequency, dtype=float), np.asarray(impedance, dtype=complex)
    if f.ndim != 1 or f.shape != z.shape:
        raise InputError(f"{source}: frequencies of shape {f.shape} and impedances of shape {z.shape} do not match")
    if SPECTRUM.most_rows and len(f) > SPECTRUM.most_rows:
        raise InputError(f"{source}: {len(f)} points; a spectrum has {SPECTRUM.most_rows} at most")
    notes: list[Finding] = []

    def drop(bad: Mask, code: str, **values: float) -> None:
        nonlocal f, z
        if bad.any():
            notes.append(Finding(code, values={"count": int(bad.sum()), **values}))
            f, z = f[~bad], z[~bad]

    drop(~(np.isfinite(f) & np.isfinite(z)), "points-blank")
    drop(~((f > _SMALLEST) & (f < _LARGEST)), "points-without-frequency")
    with np.errstate(over="ignore"):
        size = np.abs(z)
    drop(~((size > _SMALLEST) & (size < _LARGEST)), "points-dropped-out")
    order = np.argsort(f, kind="stable")
    f, z = f[order], z[order]
    repeated = np.zeros(len(f), dtype=bool)
    repeated[1:] = np.diff(f) <= _SAME * f[1:]
    drop(repeated, "points-repeated")
    inductive = _inductive(z)
    if inductive.sum() > 0.8 * len(f) > 0 or _turned(z[~inductive]):
        raise InputError(
            f"{source}: Im Z is positive over most of the band; a capacitor's is negative: if the column holds -Im Z, "
            f"call it minus_im_ohm{advice}"
        )
    if inductive.any():
        drop(inductive, "points-inductive", least=float(f[inductive][0]))
    if len(f) < _FEWEST_POINTS:
        dropped = f" ({'; '.join(map(str, notes))})" if notes else ""
        raise InputError(f"{source}: {len(f)} point{'s' * (len(f) != 1)} left, {_FEWEST_POINTS} are needed{dropped}")
    if (z.real < 0).any():
        notes.append(Finding("points-active", values={"count": int((z.real < 0).sum())}))
    return Spectrum(source, f, z, tuple(notes))


def _inductive(z: ComplexArray) -> Mask:
    """Return the points (f,) of the upper end where Im Z is positive beyond noise."""
    if not len(z):
        return np.zeros(0, dtype=bool)
    part = z.imag / np.abs(z)
    least = _INDUCTIVE_OF_FEW if len(z) < _FEW else max(_INDUCTIVE, 4 * noise_level(part))
    positive = part > least
    run = len(z) - int(np.argmin(positive[::-1])) if not positive.all() else 0
    return np.arange(len(z)) >= run


def _turned(z: ComplexArray) -> bool:
    """Return True if Im Z, apart from noise about zero, is positive rather than negative."""
    part = z.imag / np.abs(z)
    above, below = float(part[part > 0].sum()), -float(part[part < 0].sum())
    return above > max(2 * below, 0.01 * len(z))

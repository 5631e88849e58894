"""Kramers-Kronig check of a spectrum before any model is fitted: is it the answer of a linear, steady, causal thing?

By a measurement model (Boukamp 1995; Schoenleber, Klotz and Ivers-Tiffee 2014), which obeys the relations and is
linear in its unknowns, so that one least-squares solution is the whole fit:

    Z(s) = R + s L + 1/(s C) + sum over k of R_k/(1 + s tau_k),   tau_k even in logarithm over the measured band

with any sign for R_k. The number of terms is the one with the least BIC; the residuals, relative to abs(Z), are what no
such thing explains. Points that stand far out of the others' residuals are named.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..errors import InputError
from ..findings import Finding
from ..fit.criteria import structured
from ..measurements.spectrum import Spectrum
from ..units import format_quantity

#: Time constants a decade at most, and the part of the readings that the unknowns may use up.
_PER_DECADE = 7.0
_UNKNOWNS = 0.5
#: A point is bad whose residual is so many robust standard deviations, and at least this part of abs(Z).
_FAR_OUT = 6.0
_LEAST = 0.01
_MOST_BAD = 0.1
#: Residuals beyond this part of abs(Z) are worth a word: noise, and (the smaller one) a structure.
_NOISY, _STRUCTURED = 0.01, 0.003


@dataclass(frozen=True)
class KramersKronig:
    """The check's outcome. ``residuals`` (f,) are (data - measurement model)/abs(data), complex, at every frequency.

    ``bad`` (f,) are the points that were left out of the measurement model because they stand far out; ``terms`` is
    the number of time constants; ``rms`` that of the other points' residuals, real and imaginary parts together.
    """

    frequency: Array
    modelled: ComplexArray
    residuals: ComplexArray
    bad: Mask
    terms: int
    rms: float
    findings: tuple[Finding, ...]

    @property
    def consistent(self) -> bool:
        """True if nothing speaks against a linear, steady, causal system."""
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        return {
            "rms": self.rms,
            "terms": self.terms,
            "consistent": self.consistent,
            "bad_frequencies_Hz": self.frequency[self.bad].tolist(),
        }


def kramers_kronig(spectrum: Spectrum) -> KramersKronig:
    """Check a spectrum of six points or more; see the module. Raises InputError for fewer."""
    f, z = spectrum.frequency, spectrum.impedance
    if len(f) < 6:
        raise InputError(f"{spectrum.source}: {len(f)} points; the Kramers-Kronig check needs 6")
    bad = np.zeros(len(f), dtype=bool)
    modelled, terms = _measurement_model(f, z, ~bad)
    for _ in range(int(_MOST_BAD * len(f))):
        worst = _worst(z, modelled, bad)
        if worst is None:
            break
        bad[worst] = True
        modelled, terms = _measurement_model(f, z, ~bad)
    overflow = _worst(z, modelled, bad) is not None and bad.sum() >= int(_MOST_BAD * len(f)) > 0
    if overflow:  # so many that they are not exceptions: all count
        bad[:] = False
        modelled, terms = _measurement_model(f, z, ~bad)
    residuals = (z - modelled) / np.abs(z)
    kept = residuals[~bad]
    rms = float(np.sqrt(np.mean(kept.real**2 + kept.imag**2) / 2))
    return KramersKronig(f, modelled, residuals, bad, terms, rms, _findings(f, residuals, bad, rms))


def _worst(z: ComplexArray, modelled: ComplexArray, bad: Mask) -> int | None:
    """The point that stands farthest out of the others' residuals, if one does."""
    size = np.where(bad, 0.0, np.abs(z - modelled) / np.abs(z))
    # the median of the size of a complex normal of unit parts is sqrt(2 ln 2)
    spread = float(np.median(size[~bad])) / np.sqrt(2 * np.log(2))
    k = int(np.argmax(size))
    return k if size[k] > max(_FAR_OUT * spread, _LEAST) else None


def _measurement_model(f: Array, z: ComplexArray, kept: Mask) -> tuple[ComplexArray, int]:
    """Impedance at every frequency of the measurement model of least BIC on the points ``kept``, and its terms."""
    omega = 2 * np.pi * f
    weight = 1 / np.abs(z)
    low, high = omega[kept].min(), omega[kept].max()
    readings = 2 * int(kept.sum())
    most = min(int(_PER_DECADE * np.log10(high / low)) + 2, int(_UNKNOWNS * readings) - 3)
    best: tuple[float, ComplexArray, int] | None = None
    for terms in range(2, max(most, 2) + 1):
        tau = np.geomspace(1 / high, 1 / low, terms)
        s = 1j * omega[:, None]
        columns = np.concatenate([np.ones_like(s), s / high, low / s, 1 / (1 + s * tau)], axis=1)
        weighted = columns * weight[:, None]
        matrix = np.concatenate([weighted[kept].real, weighted[kept].imag])
        target = np.concatenate([(z * weight)[kept].real, (z * weight)[kept].imag])
        size = np.linalg.norm(matrix, axis=0)
        amounts = np.linalg.lstsq(matrix / size, target, rcond=1e-12)[0]
        rest = float(np.mean((matrix / size @ amounts - target) ** 2))
        # rounding is no information: below it more terms say nothing
        bic = readings * np.log(max(rest, 1e-24)) + np.log(readings) * (terms + 3)
        if best is None or bic < best[0]:
            best = (float(bic), columns / size @ amounts, terms)
    assert best is not None
    return best[1], best[2]


def _findings(f: Array, residuals: ComplexArray, bad: Mask, rms: float) -> tuple[Finding, ...]:
    found = []
    if bad.any():
        where = [format_quantity(float(x), "Hz", 4) for x in f[bad][:6]] + ["..."] * int(bad.sum() > 6)
        worst = float(np.abs(residuals[bad]).max())
        values = {"count": int(bad.sum()), "of": len(f), "worst": worst, "frequencies": where}
        found.append(Finding("kramers-kronig-points", values=values))
    kept = residuals[~bad]
    shaped = structured(kept.real) or structured(kept.imag)
    if rms > (_STRUCTURED if shaped else _NOISY):
        worst_at = float(f[~bad][int(np.argmax(np.abs(kept)))])
        values = {"rms": rms, "structure": " with a structure" if shaped else "", "at": worst_at}
        found.append(Finding("kramers-kronig-residuals", values=values))
    return tuple(found)

"""Kramers-Kronig check of a spectrum: whether it is the response of a linear, stationary, causal system.

The check uses the model of `measurement_model` for Z or for 1/Z, whichever has the larger evidence. A point is left out
only if noise, rounding and the model's error cannot explain it. Its deviation from the prediction by all other points
must be large compared with the noise of its neighbours and with the last digit of the readings; its neighbours must
not deviate; and the others must satisfy the relations. Deviations shared by neighbours are reported, without leaving
out points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from ..errors import InputError
from ..findings import Finding
from ..fit.criteria import structured
from ..measurements.smoothing import last_place
from ..measurements.spectrum import Spectrum
from ..units import format_quantity
from .measurement_model import MeasurementModel, measurement_model

#: Least deviation of a bad point: in robust standard deviations, as a fraction of abs(Z), in halves of the last digit's
#: unit, and relative to the residuals of its neighbours.
_FAR_OUT, _LEAST, _UNITS, _ALONE = 6.0, 0.01, 3.0, 3.0
#: Numbers of neighbours on either side: for the noise (the larger estimate is used), and for the residuals that a bad
#: point must exceed.
_NOISE_NEAR, _NEXT = (6, 3), 2
#: Fraction of the limits above which a point is a suspect, to be judged without the other suspects. Number of largest
#: deviations among which the point whose removal improves the fit most is taken out first.
_SUSPECT, _COMPARED = 0.3, 3
_MOST_BAD, _MOST_SUSPECTS = 0.1, 30
#: Number of neighbouring points above which they are not single outliers.
_RUN = 3
#: Least residuals that are reported, relative to abs(Z): noise, and residuals with a structure; least ratio to the
#: rounding.
_NOISY, _STRUCTURED, _OVER_ROUNDING = 0.01, 0.003, 2.0
#: Median modulus of a complex normal number whose parts have variance one, divided by sqrt(2).
_MEDIAN = np.sqrt(np.log(2))


@dataclass(frozen=True)
class KramersKronig:
    """The check's outcome. ``residuals`` (f,) are (data - measurement model)/abs(data), complex, at every frequency.

    ``bad`` (f,) is True for outliers, which were left out of the measurement model; ``terms`` is the number of time
    constants, ``freedom`` the effective number of parameters; ``rms`` is the root mean square of the other points'
    residuals, real and imaginary parts together.
    """

    frequency: Array
    modelled: ComplexArray
    residuals: ComplexArray
    bad: Mask
    terms: int
    freedom: float
    rms: float
    findings: tuple[Finding, ...]

    @property
    def consistent(self) -> bool:
        """True if the spectrum is consistent with a linear, stationary, causal system."""
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        return {
            "rms": self.rms,
            "terms": self.terms,
            "freedom": self.freedom,
            "consistent": self.consistent,
            "bad_frequencies_Hz": self.frequency[self.bad].tolist(),
            "bad_sizes": np.abs(self.residuals[self.bad]).tolist(),
        }


def kramers_kronig(spectrum: Spectrum) -> KramersKronig:
    """Check a spectrum of six points or more; see the module. Raises InputError for fewer."""
    f, z = spectrum.frequency, spectrum.impedance
    if len(f) < 6:
        raise InputError(f"{spectrum.source}: {len(f)} points; the Kramers-Kronig check needs 6")
    digit = last_digit(z)
    found = _checked(f, z, digit, admittance=False)
    if not found.consistent:
        other = _checked(f, z, digit, admittance=True)
        if other.consistent or other.rms < found.rms / 2:
            return other
    return found


def last_digit(z: ComplexArray) -> Array:
    """Return half a unit of the last digit that the readings ``z`` (f,) were given with (f,), over abs(Z).

    All readings of a column are assumed to have the digits, significant or decimal, of its longest number.
    """
    return np.asarray(np.hypot(last_place(z.real), last_place(z.imag)) / 2 / np.abs(z))


def _checked(f: Array, z: ComplexArray, digit: Array, *, admittance: bool) -> KramersKronig:
    """Return the check by the measurement model of impedances or of admittances."""
    y = 1 / z if admittance else z
    rounding = float(np.sqrt(np.mean(digit**2) / 6))

    def model(kept: Mask) -> MeasurementModel:
        return measurement_model(2 * np.pi * f, y, kept, rounding)

    whole = model(np.ones(len(f), dtype=bool))
    limits = np.maximum(_STRUCTURED, _UNITS * digit)
    found = whole if (np.abs(whole.residuals) < limits).all() else _without_bad_points(whole, model, digit)
    if not found.kept.all() and _spread(found, rounding)[1]:  # the others violate the relations too
        found = whole
    modelled = (y / np.abs(y) - found.residuals) * np.abs(y)
    if admittance:
        modelled = np.asarray(1 / np.where(modelled == 0, 1e-20 * y, modelled))
    residuals = (z - modelled) / np.abs(z)
    findings = _findings(f, found, digit, rounding)
    freedom, rms = found.freedom, _rms(found)
    return KramersKronig(f, modelled, residuals, ~found.kept, found.terms, freedom, rms, findings)


def _without_bad_points(whole: MeasurementModel, model: Any, digit: Array) -> MeasurementModel:
    """Return the measurement model without the outliers, or ``whole`` if these are not exceptions.

    All suspects are taken out, the farthest first, so that none masks another. Then points that the model explains
    return, the smallest deviation first.
    """
    most = int(_MOST_BAD * len(whole.kept))
    found, kept = whole, whole.kept.copy()
    for _ in range(min(2 * most, _MOST_SUSPECTS)):
        out = np.where(kept, _standing_out(found, digit), 0.0)
        suspects = [k for k in np.argsort(out)[::-1][:_COMPARED] if out[k] > _SUSPECT]
        if not suspects:
            break
        found = min((model(kept & (np.arange(len(kept)) != k)) for k in suspects), key=_rms)
        kept = found.kept.copy()
    while not kept.all():
        out = np.where(kept, np.inf, _standing_out(found, digit))
        shared = np.abs(found.deleted) < _ALONE * _largest_next(found)
        out = np.where(shared & ~kept, np.minimum(out, 1.0), out)
        least = int(np.argmin(out))
        if out[least] > 1:
            break
        kept[least] = True
        found = model(kept.copy())
    side_by_side = np.convolve(~kept, np.ones(_RUN)).max() >= _RUN
    return whole if side_by_side or (~kept).sum() > most else found


def _standing_out(found: MeasurementModel, digit: Array) -> Array:
    """Return the deviation of every point (f,) from its prediction by the others, relative to the limit."""
    noise = np.full(len(digit), np.median(found.surprise[found.kept]))
    for half in _NOISE_NEAR:
        noise = np.maximum(noise, np.median(found.surprise[_near(found.kept, half)], axis=1))
    by_noise = found.surprise / np.maximum(_FAR_OUT * noise / _MEDIAN, np.finfo(float).tiny)
    return np.asarray(np.minimum(by_noise, np.abs(found.deleted) / np.maximum(_LEAST, _UNITS * digit)))


def _largest_next(found: MeasurementModel) -> Array:
    """Return the largest residual (f,) of each point's nearest kept neighbours."""
    return np.asarray(np.abs(found.residuals)[_near(found.kept, _NEXT)].max(axis=1))


def _near(kept: Mask, half: int) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the nearest kept points of each point (f, 2 half), without itself."""
    at = np.flatnonzero(kept)
    gap = np.abs(at[None, :] - np.arange(len(kept))[:, None]).astype(float)
    gap[gap == 0] = np.inf
    return np.asarray(at[np.argsort(gap, axis=1, kind="stable")[:, : min(2 * half, len(at) - 1)]])


def _rms(found: MeasurementModel) -> float:
    return float(np.sqrt(np.mean(np.abs(found.residuals[found.kept]) ** 2) / 2))


def _spread(found: MeasurementModel, rounding: float) -> tuple[bool, bool]:
    """Return True if the kept points' residuals have structure, and True if that is to be reported."""
    kept = found.residuals[found.kept]
    shaped = structured(kept.real) or structured(kept.imag)
    return shaped, shaped and _rms(found) > max(_STRUCTURED, _OVER_ROUNDING * rounding)


def _findings(f: Array, found: MeasurementModel, digit: Array, rounding: float) -> tuple[Finding, ...]:
    findings, bad = [], ~found.kept
    if bad.any():
        sizes = np.abs(found.residuals[bad])
        frequencies = f[bad]
        shown = [f"{format_quantity(float(x), 'Hz', 4)} ({s:.1%})" for x, s in zip(frequencies, sizes, strict=True)]
        values = {
            "count": int(bad.sum()),
            "of": len(f),
            "worst": float(sizes.max()),
            "frequencies_Hz": frequencies.tolist(),
            "sizes": sizes.tolist(),
            "shown": shown[:6] + ["..."] * (len(shown) > 6),
        }
        findings.append(Finding("kramers-kronig-points", values=values))
    kept, at = np.abs(found.residuals[found.kept]), f[found.kept]
    shaped, worth = _spread(found, rounding)
    if worth or _rms(found) > max(_NOISY, _OVER_ROUNDING * rounding):
        structure = " with a structure" if shaped else ""
        values = {"rms": _rms(found), "structure": structure, "at": float(at[int(np.argmax(kept))])}
        findings.append(Finding("kramers-kronig-residuals", values=values))
    elif kept.max() > _STRUCTURED and _standing_out(found, digit)[found.kept].max() > 1:
        values = {"at": float(at[int(np.argmax(kept))]), "worst": float(kept.max())}
        findings.append(Finding("kramers-kronig-disturbed", values=values))
    return tuple(findings)

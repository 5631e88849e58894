"""Computes starting values for a fit of several files from their individual fits.

Files determine different parameters: a spectrum at high frequency does not depend on the electron path, a short step
does not depend on a slow branch. Individual results are therefore averaged with their information as weights, and
branches are also selected from all results together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..fit.parameter import Parameter, Scales
from ..fit.result import FitResult
from ..strip.models import ElectricalModel
from .port_model import BY_TIME, DC, INFINITE, IndividualFit, PortData

#: Largest number of individual results that are tried unchanged.
_MOST_INDIVIDUAL = 4
#: Largest standard error of a logarithm that is used as a starting value.
_LOOSE = 1.0
#: Eigenvalue, relative to the largest, below which no file determines a direction.
_UNFELT = 1e-12
#: Emission voltages that are tried, relative to the largest voltage.
_EMISSIONS = np.geomspace(0.05, 5.0, 60)


def combined(parameters: Sequence[Parameter], fits: Sequence[FitResult], independent: Sequence[float]) -> Array:
    """Return the average (n,) of all ``fits``, weighted by their information; NaN where that is too small.

    In the fit's coordinates x = (sum of H)^+ sum of H x, with the inverse covariance H. ``independent`` are the numbers
    of independent samples of the fits.
    """
    names = [p.name for p in parameters]
    information, sums = np.zeros((len(names), len(names))), np.zeros(len(names))
    felt = np.zeros(len(names), dtype=bool)
    for fit, samples in zip(fits, independent, strict=True):
        index = np.array([k for k, name in enumerate(fit.labels) if name in names], dtype=int)
        places = np.array([names.index(fit.labels[k]) for k in index], dtype=int)
        scales = Scales.of([parameters[k] for k in places])
        x = scales.coordinates(fit.values[index])
        slopes = scales.slopes(x)
        covariance = fit.covariance[np.ix_(index, index)] / np.outer(slopes, slopes)
        h = np.linalg.pinv(covariance, rcond=_UNFELT, hermitian=True) * samples / len(fit.residuals)
        information[np.ix_(places, places)] += h
        sums[places] += h @ x
        felt[places] = True
    result = np.full(len(names), np.nan)
    if felt.any():
        size = np.sqrt(np.diag(information)[felt])
        among = information[np.ix_(felt, felt)] / np.outer(size, size)
        covariance = np.linalg.pinv(among, rcond=_UNFELT, hermitian=True)
        known = np.sqrt(np.diag(covariance)) / size < _LOOSE
        values = Scales.of(parameters).part(felt).values(covariance @ (sums[felt] / size) / size)
        result[felt] = np.where(known, values, np.nan)
    return result


def suggestions(
    kind: ElectricalModel, data: Sequence[PortData], individual: Sequence[IndividualFit], *, opened: bool = False
) -> list[Array]:
    """Return starts (n,) for the parameters of ``kind`` from the individual fits, with an ``opened`` electron path."""
    fits, independent = [i.fit for i in individual], [i.independent for i in individual]
    typical = combined(kind.parameters, fits, independent)
    largest = max((abs(d.voltage) for d in data), default=0.0) or 1.0
    known = {a.parameter.name: a.start(largest) for a in kind.additions}
    known |= {name: v for name, v in zip(kind.names, typical.tolist(), strict=True) if np.isfinite(v) and v > 0}
    known |= {DC: INFINITE} if opened else {}
    ranked = sorted(zip(data, individual, strict=True), key=lambda pair: -pair[1].independent)
    complete = [i for _, i in ranked if i.sure and set(kind.names) <= known.keys() | i.values.keys()]
    found = [known, *(known | i.values for i in complete[:_MOST_INDIVIDUAL]), *_pooled(kind, known, ranked)]
    if "emission_voltage" in kind.names:
        found = [values | _chord(data, individual, largest) for values in found] + found
    sets = [np.array([v[name] for name in kind.names]) for v in found if set(kind.names) <= v.keys()]
    upper = np.array([p.upper for p in kind.parameters])
    return [v for v in sets if (v > 0).all() and (v < upper).all()]


def _pooled(
    kind: ElectricalModel, known: dict[str, float], ranked: Sequence[tuple[PortData, IndividualFit]]
) -> list[dict[str, float]]:
    """Return starts from the branches of two individual fits, of different kinds of data if available."""
    first, *others = ranked
    others.sort(key=lambda pair: pair[0].quantity == first[0].quantity)
    pairs: list[tuple[float, float]] = []
    for _, i in (first, *others[:1]):
        names = i.model.kind.names
        if i.sure and set(names) <= i.values.keys():
            pairs += i.model.kind.pairs([i.values[name] for name in names])
    pairs.sort(key=lambda pair: pair[0] * pair[1])
    return [known | ions for ions in kind.pooled_starts(pairs)]


def _chord(data: Sequence[PortData], individual: Sequence[IndividualFit], largest: float) -> dict[str, float]:
    """Return emission voltage and Rdc from the steady conductances under several voltages, the chords of the sinh law.

    1/R(u) = sinh(u/Vt)/(u/Vt)/Rdc; empty if there is only one voltage.
    """
    pairs = {
        abs(d.voltage): i.values["dc_resistance"]
        for d, i in zip(data, individual, strict=True)
        if d.quantity in BY_TIME and "dc_resistance" in i.values
    }
    if len(pairs) < 2:
        return {}
    u, resistance = np.array(list(pairs)), np.array(list(pairs.values()))
    ratio = np.minimum(u / (largest * _EMISSIONS[:, None]), 300.0)
    chords = np.log(resistance) + np.log(np.sinh(ratio) / ratio)
    best = int(np.argmin(chords.var(axis=1)))
    return {"emission_voltage": float(largest * _EMISSIONS[best]), "dc_resistance": float(np.exp(chords[best].mean()))}

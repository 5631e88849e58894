"""Where a fit of several data sets starts: from what each of them says by itself.

One data set may not feel what another determines: a spectrum at high frequency no electron path, a short step no slow
branch. So own answers are averaged by their information, and branches are also drawn from all answers together.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..fit.least_squares import Fit
from ..fit.problem import Scales
from ..strip.models import ElectricalModel
from .datasets import Dataset, OwnFit

Array = NDArray[np.float64]

#: So many own answers are tried as they are.
_MOST_OWN = 4
#: A logarithm with a standard error beyond this is not known well enough to start from.
_LOOSE = 1.0
#: Directions that no data set feels, relative to the best felt one.
_UNFELT = 1e-12
#: Emission voltages tried, in parts of the largest voltage.
_EMISSIONS = np.geomspace(0.05, 5.0, 60)


def combined(names: Sequence[str], below: Array, fits: Sequence[Fit], independent: Sequence[float]) -> Array:
    """Values (n,) of ``names`` by all ``fits``, each with the weight of its information; NaN where that is too little.

    In the coordinates in which `fit_circuit` works: x = (sum of H)^+ sum of H x, H the inverse covariance.
    """
    information, sums = np.zeros((len(names), len(names))), np.zeros(len(names))
    felt = np.zeros(len(names), dtype=bool)
    for fit, samples in zip(fits, independent, strict=True):
        index = np.array([k for k, name in enumerate(fit.names) if name in names])
        places = np.array([list(names).index(fit.names[k]) for k in index])
        own = Scales(below[places])
        x = own.coordinates(fit.values[index])
        slopes = own.slopes(x)
        covariance = fit.covariance[np.ix_(index, index)] / np.outer(slopes, slopes)
        h = np.linalg.pinv(covariance, rcond=_UNFELT, hermitian=True) * samples / len(fit.residuals)
        information[np.ix_(places, places)] += h
        sums[places] += h @ x
        felt[places] = True
    result = np.full(len(names), np.nan)
    if felt.any():
        among = np.ix_(felt, felt)
        size = np.sqrt(np.diag(information)[felt])
        covariance = np.linalg.pinv(information[among] / np.outer(size, size), rcond=_UNFELT, hermitian=True)
        known = np.sqrt(np.diag(covariance)) / size < _LOOSE
        with np.errstate(over="ignore"):
            values = Scales(below[felt]).values(covariance @ (sums[felt] / size) / size)
        result[felt] = np.where(known, values, np.nan)
    return result


def suggestions(kind: ElectricalModel, datasets: Sequence[Dataset], own: Sequence[OwnFit]) -> list[Array]:
    """Sets of parameters (n,) of ``kind`` that the own fits suggest."""
    below = np.array([p.upper for p in kind.parameters])
    typical = combined(kind.names, below, [o.fit for o in own], [o.independent for o in own])
    largest = max((abs(d.voltage) for d in datasets), default=0.0) or 1.0
    known = {"emission_voltage": largest, "capacitance_slope": 0.2 / largest}
    known |= {name: v for name, v in zip(kind.names, typical.tolist(), strict=True) if np.isfinite(v) and v > 0}
    ranked = sorted(zip(datasets, own, strict=True), key=lambda pair: -pair[1].independent)
    complete = [o for _, o in ranked if o.sure and set(kind.names) <= known.keys() | o.values.keys()]
    found = [known, *(known | o.values for o in complete[:_MOST_OWN]), *_pooled(kind, known, ranked)]
    if "emission_voltage" in kind.names:
        found = [values | _chord(datasets, own, largest) for values in found] + found
    sets = [np.array([v[name] for name in kind.names]) for v in found if set(kind.names) <= v.keys()]
    return [v for v in sets if (v > 0).all() and (v < below).all()]


def _pooled(
    kind: ElectricalModel, known: dict[str, float], ranked: Sequence[tuple[Dataset, OwnFit]]
) -> list[dict[str, float]]:
    """Branches in every combination out of those that two own fits found, of different kinds where there are both."""
    count = {"rc2": 2, "rc3": 3}.get(kind.name.split("+")[0], 0)
    if not count or "dc_resistance" not in known:
        return []
    first, *others = ranked
    others.sort(key=lambda pair: pair[0].quantity == first[0].quantity)
    pairs: list[tuple[float, float]] = []
    for _, o in (first, *others[:1]):
        values = o.values if o.sure else {}
        names = [("dynamic_resistance", "capacitance"), *((f"resistance_{k}", f"capacitance_{k}") for k in (1, 2, 3))]
        pairs += [(values[r], values[c]) for r, c in names if r in values]
    pairs.sort(key=lambda pair: pair[0] * pair[1])
    found = []
    for chosen in combinations(pairs, count):
        branches = {f"resistance_{k}": r for k, (r, _) in enumerate(chosen, 1)}
        found.append(known | branches | {f"capacitance_{k}": c for k, (_, c) in enumerate(chosen, 1)})
    return found


def _chord(datasets: Sequence[Dataset], own: Sequence[OwnFit], largest: float) -> dict[str, float]:
    """Emission voltage and Rdc from the steady conductances under several voltages, the chords of the sinh law.

    1/R(u) = sinh(u/Vt)/(u/Vt)/Rdc; nothing where there is one voltage only.
    """
    pairs = {
        abs(d.voltage): o.values["dc_resistance"]
        for d, o in zip(datasets, own, strict=True)
        if d.quantity == "current" and "dc_resistance" in o.values
    }
    if len(pairs) < 2:
        return {}
    u, resistance = np.array(list(pairs)), np.array(list(pairs.values()))
    ratio = np.minimum(u / (largest * _EMISSIONS[:, None]), 300.0)
    rest = np.log(resistance) + np.log(np.sinh(ratio) / ratio)
    best = int(np.argmin(rest.var(axis=1)))
    return {"emission_voltage": float(largest * _EMISSIONS[best]), "dc_resistance": float(np.exp(rest[best].mean()))}

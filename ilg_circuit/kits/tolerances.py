"""The covariance of a fit as factors on the parameters of a strip's subcircuit, for corners and Monte Carlo.

A fit knows the covariance C of the logarithms of its parameters p. With C = L L^T and standard normal numbers z,
log p moves by L z. A subcircuit has parameters q of the material; their logarithms follow by the slopes
S = d log q/d log p, which are constants where q is a product of powers of p. So q moves by exp(S L z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..circuit.library import library_parameters
from ..simulation.prediction_band import scaled
from ..strip.actuator import Actuator, quantities
from ..strip.ladder import LADDER_BAND

#: Step of a parameter's logarithm by which slopes are found.
_STEP = 1e-3
#: Slopes below this are rounding.
_ROUNDING = 1e-9
#: Name in the subcircuit of the sum of the electrodes' resistances, which a fit knows as one.
ELECTRODES = "electrodes"


@dataclass(frozen=True)
class Tolerances:
    """How a subcircuit's parameters move with standard normal numbers z.

    ``names`` (n,) are the fit's parameters and ``covariance`` (n, n) that of their logarithms; ``factor`` (n, n) is its
    lower triangle L. ``moved`` has, for each parameter of the subcircuit, the coefficients (n,) of z in its logarithm.
    ``fixed`` are parameters of the fit that the subcircuit cannot vary: they stay as fitted.
    """

    names: tuple[str, ...]
    covariance: Array
    factor: Array
    moved: dict[str, Array]
    fixed: tuple[str, ...] = ()

    @property
    def stderr(self) -> Array:
        """Standard errors (n,) of the parameters, in parts of them."""
        return np.sqrt(self.covariance.diagonal())

    def corners(self, sigmas: float) -> Array:
        """Return z (2 n, n) that put each parameter ``sigmas`` standard errors up, then down.

        The others go where the covariance expects them then.
        """
        rows = sigmas * self.factor / self.stderr[:, None]
        return np.concatenate([[row, -row] for row in rows])

    def draws(self, count: int, seed: int) -> Array:
        """Return ``count`` random z (count, n), whose mean is 0 and whose covariance is 1, both exactly.

        So the spread of what depends on them in proportion has no error of sampling.
        """
        z = np.random.default_rng(seed).standard_normal((count, len(self.names)))
        z -= z.mean(axis=0)
        return np.linalg.solve(np.linalg.cholesky(z.T @ z / (count - 1)), z.T).T


def tolerances(actuator: Actuator) -> Tolerances | None:
    """Return what the fit of a strip left open; None where it comes from no fit, or from one that is exact.

    Raises InputError where the covariance names parameters that the strip has not.
    """
    uncertainty = actuator.uncertainty
    if uncertainty is None:
        return None
    offered = {q.name for q in library_parameters(actuator, "dynamic")}
    slopes, fixed = {}, []
    for name in uncertainty.names:
        found = _slopes(actuator, name)
        if found.keys() <= offered | {ELECTRODES}:
            slopes[name] = found
        else:
            fixed.append(name)
    covariance = np.array(uncertainty.covariance)
    kept = [k for k, name in enumerate(uncertainty.names) if name in slopes and covariance[k, k] > 0]
    if not kept:
        return None
    names = tuple(uncertainty.names[k] for k in kept)
    covariance = covariance[np.ix_(kept, kept)]
    factor = _lower(covariance)
    everything = dict.fromkeys(q for name in names for q in slopes[name])
    moved = {q: np.array([slopes[name].get(q, 0.0) for name in names]) @ factor for q in everything}
    return Tolerances(names, covariance, factor, moved, tuple(fixed))


def _slopes(actuator: Actuator, name: str) -> dict[str, float]:
    """Return d log q/d log p for each quantity q of the strip that moves with its fitted parameter p."""
    low, high = (_logarithms(scaled(actuator, {name: np.exp(s * _STEP)}, LADDER_BAND)) for s in (-1.0, 1.0))
    found = {q: (high[q] - low[q]) / (2 * _STEP) for q in high}
    return {q: float(slope) for q, slope in found.items() if abs(slope) > _ROUNDING}


def _logarithms(actuator: Actuator) -> dict[str, float]:
    """Return the logarithm of every quantity that is not zero, by its name in a subcircuit."""
    m = actuator.material
    found = {q.name: q.value for q in quantities(m) if not q.name.startswith(("electrode_", "ladder_"))}
    for k, branch in enumerate(m.further_branches, 2):
        found |= {f"{q.name}_{k}": q.value for q in quantities(branch)}
    if actuator.coupling is not None:
        found |= {f"coupling_{q.name}": q.value for q in quantities(actuator.coupling)}
    layers = (
        (m.electrode_resistivity_1, m.electrode_thickness_1),
        (m.electrode_resistivity_2, m.electrode_thickness_2),
    )
    found[ELECTRODES] = sum(r * t for r, t in layers)
    return {name: float(np.log(abs(value))) for name, value in found.items() if value}


def _lower(covariance: Array) -> Array:
    """Return the lower triangle L with L L^T = C, of a C that may be singular, too."""
    values, vectors = np.linalg.eigh(covariance)
    upper = np.linalg.qr((vectors * np.sqrt(np.clip(values, 0.0, None))).T).R
    signs = np.where(upper.diagonal() < 0, -1.0, 1.0)
    return np.tril((signs[:, None] * upper).T)

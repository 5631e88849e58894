"""Where fits of a spectrum start: parameter sets that its size and its frequencies suggest.

Time constants are scattered over the band and beyond (diffusion: in ascending order, so that a search can start in
every part of the band); what is linear once they are given (branches add in the admittance, resistances and a diffusion
in the impedance) is solved for by non-negative least squares.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..measurements.spectrum import Spectrum
from ..strip.models import ElectricalModel

Array = NDArray[np.float64]

_SETS = 60
#: A branch or resistance that non-negative least squares leaves out enters by this part of the data's size.
_LITTLE = 1e-3


def starts(
    model: ElectricalModel, spectrum: Spectrum, electrode_resistance: float, random: np.random.Generator
) -> Array:
    """Parameter sets (m, n), SI, in the order of ``model``'s parameters, Re held [ohm]."""
    z = spectrum.impedance - electrode_resistance
    omega = 2 * np.pi * spectrum.frequency
    if model.name in ("warburg", "cpe"):
        places = (np.arange(_SETS) + random.uniform(0, 1, _SETS)) / _SETS
        return np.array([_diffusion(model.name, float(place), z, omega, random) for place in places])
    count = (len(model.parameters) - 1) // 2
    return np.array([_branches(count, z, omega, random) for _ in range(_SETS)])


def _branches(count: int, z: NDArray[np.complex128], omega: Array, random: np.random.Generator) -> Array:
    """Y = 1/Rdc + sum of C s/(1 + tau s), linear in 1/Rdc and every C once the time constants are given."""
    low, high = np.log(0.3 / omega[-1]), np.log(10 / omega[0])
    tau = np.exp(np.sort(random.uniform(low, high, count)))
    s = 1j * omega[:, None]
    y = 1 / z
    amounts = _solved(np.concatenate([np.ones_like(s), s / (1 + s * tau)], axis=1), y)
    pairs = [(t / c, c) for t, c in zip(tau, amounts[1:], strict=True)]
    return np.array([1 / amounts[0], *(value for pair in pairs for value in pair)])


def _diffusion(law: str, place: float, z: NDArray[np.complex128], omega: Array, random: np.random.Generator) -> Array:
    """Z = Rs + amount times a shape, by its ``place`` (0 to 1); Rdc beside it at random: often it is hardly seen."""
    from ..strip.ladder import cpe_impedance, warburg_impedance

    s = 1j * omega
    size = np.abs(z)
    dc = float(size.max()) * 10 ** random.choice([random.uniform(0, 0.3), random.uniform(0, 3)])
    ions = 1 / (1 / z - 1 / dc)
    if law == "warburg":
        tau = float((0.3 / omega[-1]) ** (1 - place) * (30 / omega[0]) ** place)
        shape = warburg_impedance(s, 1.0, tau)
    else:
        exponent = 0.3 + 0.68 * place
        shape = cpe_impedance(s, 1.0, exponent)
    series, amount = _solved(np.column_stack([np.ones_like(s), shape]), ions)
    if law == "warburg":
        return np.array([dc, series, amount, tau])
    return np.array([dc, series, 1 / amount, exponent])


def _solved(columns: NDArray[np.complex128], target: NDArray[np.complex128]) -> Array:
    """Positive amounts (k,) of ``columns`` (f, k) nearest to ``target`` (f,), in relative terms."""
    from scipy.optimize import nnls

    relative = columns / np.abs(target)[:, None]
    matrix = np.concatenate([relative.real, relative.imag])
    aim = np.concatenate([(target / np.abs(target)).real, (target / np.abs(target)).imag])
    size = np.linalg.norm(matrix, axis=0)
    size[size == 0] = 1.0
    amounts = nnls(matrix / size, aim)[0]
    return np.asarray(np.maximum(amounts, _LITTLE * float(np.linalg.norm(aim))) / size)

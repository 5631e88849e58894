"""An interface in series with diffusion of a free exponent, as in spectra of porous carbon electrodes.

    Zp = Rs + R/(1 + (s T)^alpha) + Rw coth((s tau)^a)/(s tau)^a

The second term is a resistance R parallel to a constant phase element Q = T^alpha/R, a flattened arc; the third one is
generalised finite diffusion, the finite Warburg element for a = 1/2. Both are integrals of relaxations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, ComplexArray
from ...fit.parameter import Parameter
from ..ladder import Relaxations
from .ladder_path import LadderPath
from .model import Pair, Shown
from .starts import amounts, scattered
from .warburg import DIFFUSION_TIME, WARBURG_RESISTANCE, coth_over

#: Distance of exponents below the values at which the peaks of the density of relaxations become lines.
_ARC_MOST, _DIFFUSION_MOST = 0.9995, 0.4998
_ARC_EXPONENT, _DIFFUSION_EXPONENT = 0.8, 0.46

_INTERFACE = (
    Parameter("interface_time", "T", "s", "time constant of the interface; Q = T^alpha/R"),
    Parameter("interface_exponent", "alpha", "", "interface: 1 a capacitor, less a flattened arc", upper=1.0),
)
_DIFFUSION = (
    DIFFUSION_TIME,
    Parameter("diffusion_exponent", "a", "", "diffusion: 1/2 is Warburg's, 0.3 to 0.5 found", upper=0.5),
)


@dataclass(frozen=True)
class Randles(LadderPath):
    """A series resistance, the arc of an interface, and finite diffusion with a free exponent."""

    name = "randles"
    title = "Randles element"
    name_in_tables = "Randles"
    equation = "Z = Re + Rdc || (Rs + R/(1 + (s T)^alpha) + Rw coth((s tau)^a)/(s tau)^a)"
    constants = (
        Parameter("interface_resistance", "R", "ohm", "interface, parallel to a constant phase element"),
        *_INTERFACE,
        WARBURG_RESISTANCE,
        *_DIFFUSION,
    )
    material = (Parameter("interface_resistivity", "rho_i", "ohm m", "of the interface"), *_INTERFACE, *_DIFFUSION)

    def element(self, values: Array, s: ComplexArray) -> ComplexArray:
        r, t, alpha, rw, tau, a = values.T[:, :, None]
        return np.asarray(arc_impedance(s, r, t, alpha) + diffusion_impedance(s, rw, tau, a))

    def relaxations(self, constants: Sequence[float]) -> Relaxations:
        alpha, a = min(constants[2], _ARC_MOST), min(constants[5], _DIFFUSION_MOST)
        kept = np.array([[*constants[:2], alpha, *constants[3:5], a]])
        width = math.pi * min((1 - alpha) / alpha, (1 - 2 * a) / (2 * a))
        return Relaxations(lambda s: np.asarray(self.element(kept, s)[0]), width, lambda logs: _density(kept[0], logs))

    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        series, r, t, alpha, rw, tau, a = values
        keyed = dict(zip((key.name for key in self.material), (r, t, alpha, tau, a), strict=True))
        return {"dynamic_resistivity": series, "permittivity": tau / rw} | keyed

    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        r, t, alpha, tau, a = (constants[key.name] for key in self.material)
        return constants["dynamic_resistivity"], r, t, alpha, tau / constants["permittivity"], tau, a

    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        """Return starts: the interface takes half of the fast resistance; diffusion as for a Warburg element."""
        fast = 1 / sum(1 / r for r, _ in pairs)
        constants = [r * c for r, c in pairs]
        tau = np.pi**2 / 4 * max(constants)
        total = sum(c for _, c in pairs)
        return [fast / 2, fast / 2, min(constants) / 3, _ARC_EXPONENT, tau / total, tau, _DIFFUSION_EXPONENT]

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        s: ComplexArray = np.asarray(1j * omega, dtype=complex)

        def start(ions: ComplexArray, place: float) -> list[float]:
            tau = float((3 / omega[-1]) ** (1 - place) * (30 / omega[0]) ** place)
            t = float(math.exp(random.uniform(math.log(0.3 / omega[-1]), math.log(tau))))
            alpha, a = float(random.uniform(0.6, 0.95)), float(random.uniform(0.38, 0.495))
            shapes = (np.ones_like(s), arc_impedance(s, 1.0, t, alpha), diffusion_impedance(s, 1.0, tau, a))
            series, r, rw = amounts(np.column_stack(shapes), ions)
            return [series, r, t, alpha, rw, tau, a]

        return scattered(z, random, start)

    def derived(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        _, r, t, alpha, rw, tau, _ = values
        return {"interface_coefficient": (t**alpha / r, "F s^(a-1)"), "diffusion_capacitance": (tau / rw, "F")}

    def shown_element(self, constants: Sequence[float]) -> list[Shown]:
        rows = super().shown_element(constants)
        return [*rows, ("capacitance", constants[4] / constants[3], "F", "EC (14): C = eps L w/b = tau/Rw")]


def _density(constants: Array, logs: Array) -> Array:
    """Return -Im Z(-lambda + i0) [ohm] of a Randles element of ``constants`` at ``logs`` of lambda."""
    r, t, alpha, rw, tau, a = constants.tolist()
    x = np.exp(alpha * (logs + math.log(t)))
    arc = r * math.sin(math.pi * alpha) * x / (1 + x * (x + 2 * math.cos(math.pi * alpha)))
    y = np.exp(a * (logs + math.log(tau)))
    p, q = math.cos(math.pi * a) * y, math.sin(math.pi * a) * y
    # coth(p + iq) = (A - iB)/D
    small = np.exp(-2 * p)
    down = np.expm1(-2 * p) ** 2 + 4 * small * np.sin(q) ** 2
    return np.asarray(arc + rw * (-np.expm1(-4 * p) * q + 2 * small * np.sin(2 * q) * p) / (down * y**2))


RANDLES = Randles()


def arc_impedance(
    s: ComplexArray, resistance: float | Array, time_constant: float | Array, exponent: float | Array
) -> ComplexArray:
    """Return R/(1 + (s T)^alpha) [ohm]: R parallel to a constant phase element."""
    return np.asarray(resistance / (1 + (s * time_constant) ** exponent))


def diffusion_impedance(
    s: ComplexArray, resistance: float | Array, time_constant: float | Array, exponent: float | Array
) -> ComplexArray:
    """Return Rw coth((s tau)^a)/(s tau)^a [ohm]: generalised finite diffusion, reflecting."""
    return coth_over(np.asarray((s * time_constant) ** exponent), resistance)

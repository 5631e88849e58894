"""Incompressible Ogden materials: energy, stress in the three standard tests, stability.

The convention is that of *Motion Simulation of Ionic Liquid Gel Soft Actuators Based on CPG Control*, section 4:

    W = sum mu_i/alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3),    l1 l2 l3 = 1,    G = 1/2 sum mu_i alpha_i

Other books and programs write W = sum 2 mu_i/alpha_i^2 (...), where G = sum mu_i; `Ogden.moduli` and
`Ogden.from_moduli` convert. In every test one stretch l is imposed; the traction-free direction has the stretch l^k:
k = -1/2 uniaxial, -2 equibiaxial, -1 planar. Neo-Hookean is alpha = 2, Mooney-Rivlin alpha = (2, -2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, wrong_choice
from ..measurements.load_test import LOAD_MODES

#: mode -> k, the free direction's stretch being l^k
MODES: dict[str, float] = dict(zip(LOAD_MODES, (-0.5, -2.0, -1.0), strict=True))

CONVENTION = "W = sum mu_i/alpha_i (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), G = 1/2 sum mu_i alpha_i"
OTHER_CONVENTION = "W = sum 2 mu_i/alpha_i^2 (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3), G = sum mu_i"


@dataclass(frozen=True)
class Ogden:
    """An incompressible Ogden material: ``mu`` [Pa] and ``alpha`` [1], one of each per term, paper's convention.

    mu_i alpha_i > 0 for every term suffices for stability; it is not necessary, and not required here.
    """

    mu: tuple[float, ...]
    alpha: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "mu", tuple(float(m) for m in self.mu))
        object.__setattr__(self, "alpha", tuple(float(a) for a in self.alpha))
        if not self.mu or len(self.mu) != len(self.alpha):
            raise InputError(f"{len(self.mu)} values of mu and {len(self.alpha)} of alpha; give one pair for each term")
        if not all(math.isfinite(v) for v in (*self.mu, *self.alpha)):
            raise InputError(f"mu {self.mu}, alpha {self.alpha}: give finite values")
        if 0 in self.alpha:
            raise InputError("alpha is 0: such a term has no finite mu in this convention; leave it out")

    @classmethod
    def from_moduli(cls, moduli: ArrayLike, alpha: ArrayLike) -> Ogden:
        """Return the material whose mu_i are ``moduli`` [Pa] in the convention W = sum 2 mu_i/alpha_i^2 (...)."""
        pairs = list(zip(np.atleast_1d(moduli).tolist(), np.atleast_1d(alpha).tolist(), strict=True))
        if any(a == 0 for _, a in pairs):
            raise InputError("alpha is 0: such a term has no finite mu in the paper's convention; leave it out")
        return cls(tuple(2 * g / a for g, a in pairs), tuple(a for _, a in pairs))

    @classmethod
    def neo_hookean(cls, shear_modulus: float) -> Ogden:
        """Return the neo-Hookean material W = G/2 (I1 - 3) of ``shear_modulus`` G [Pa]."""
        return cls((shear_modulus,), (2.0,))

    @classmethod
    def mooney_rivlin(cls, c10: float, c01: float) -> Ogden:
        """Return the Mooney-Rivlin material W = C10 (I1 - 3) + C01 (I2 - 3); both constants in Pa."""
        return cls((2 * c10, -2 * c01), (2.0, -2.0))

    @property
    def moduli(self) -> tuple[float, ...]:
        """mu_i alpha_i/2 [Pa]: each term's part of G, and its mu_i in the convention W = sum 2 mu_i/alpha_i^2 (...)."""
        return tuple(m * a / 2 for m, a in zip(self.mu, self.alpha, strict=True))

    @property
    def shear_modulus(self) -> float:
        """The initial shear modulus G = 1/2 sum mu_i alpha_i [Pa]."""
        return math.fsum(self.moduli)

    @property
    def youngs_modulus(self) -> float:
        """The initial Young's modulus E = 3 G [Pa]; 3 because the material is incompressible."""
        return 3 * self.shear_modulus

    @property
    def stable_by_sign(self) -> bool:
        """True if mu_i alpha_i > 0 for every term, so that the material is stable at every stretch."""
        return all(g > 0 for g in self.moduli)

    def nominal(self, mode: str, stretch: ArrayLike) -> Array:
        """Return the nominal stress [Pa] on the undeformed area: P = sum mu_i (l^(alpha_i - 1) - l^(k alpha_i - 1))."""
        stretches = _stretches(stretch)
        parts = stress_basis(mode, stretches, self.alpha)
        return np.asarray(parts @ np.array(self.moduli))

    def cauchy(self, mode: str, stretch: ArrayLike) -> Array:
        """Return the Cauchy (true) stress [Pa], force over deformed area: l P."""
        return np.asarray(_stretches(stretch) * self.nominal(mode, stretch))

    def slope(self, mode: str, stretch: ArrayLike) -> Array:
        """Return dP/dl [Pa] of the nominal stress; at l = 1 it is E uniaxial, 2 E equibiaxial, 4/3 E planar."""
        given, k = _stretches(stretch)[..., None], _mode(mode)
        mu, alpha = np.array(self.mu), np.array(self.alpha)
        terms = (alpha - 1) * given ** (alpha - 2) - (k * alpha - 1) * given ** (k * alpha - 2)
        return np.asarray((mu * terms).sum(axis=-1))

    def energy(self, principal: ArrayLike) -> Array:
        """Return the strain energy density W [J/m^3] at principal stretches (..., 3) of product 1 (incompressible)."""
        stretches = _stretches(principal)
        if stretches.shape[-1:] != (3,) or np.abs(np.prod(stretches, axis=-1) - 1).max(initial=0.0) > 1e-9:
            raise InputError("give three principal stretches whose product is 1: the material is incompressible")
        logs = np.log(stretches)[..., None]
        parts = np.expm1(logs * np.array(self.alpha)).sum(axis=-2)
        return np.asarray(parts @ (np.array(self.mu) / np.array(self.alpha)))

    def hardening(self, mode: str, stretch: ArrayLike) -> Array:
        """Return the smallest principal stiffness [Pa] to isochoric strain at a test's stretches; <= 0 is unstable.

        Drucker's condition: the Kirchhoff stress does positive work on every increment of logarithmic strain. For a
        sum over principal stretches the stiffnesses are d_j = sum mu_i alpha_i l_j^alpha_i, restricted to strains
        of zero sum; at l = 1 both eigenvalues are 2 G.
        """
        first = _stretches(stretch)
        third = first ** _mode(mode)
        second = {"uniaxial": third, "equibiaxial": first, "planar": np.ones_like(first)}[mode]
        twice = 2 * np.array(self.moduli)
        d1, d2, d3 = (np.asarray(s[..., None] ** np.array(self.alpha) @ twice) for s in (first, second, third))
        trace = 2 * (d1 + d2 + d3) / 3
        determinant = (d1 * d2 + d2 * d3 + d3 * d1) / 3
        root = np.sqrt(np.maximum(trace**2 / 4 - determinant, 0))
        # the smaller root from the product of both, since their difference would cancel
        return np.where(trace > 0, determinant / (trace / 2 + root), trace / 2 - root)


def stress_basis(mode: str, stretch: Array, alpha: ArrayLike) -> Array:
    """Return nominal stress of each term per unit of its modulus mu_i alpha_i/2, (..., terms): 2 (l^a - l^(k a))/(a l).

    The form used is smooth through alpha = 0 and accurate near l = 1.
    """
    k, logs, a = _mode(mode), np.log(stretch)[..., None], np.asarray(alpha, dtype=float)
    return np.asarray(2 * (1 - k) * logs * np.exp((k * a - 1) * logs) * _relative(((1 - k) * a) * logs))


def stress_basis_slope(mode: str, stretch: Array, alpha: ArrayLike) -> Array:
    """Return the derivative of `stress_basis` by alpha, (..., terms)."""
    k, logs, a = _mode(mode), np.log(stretch)[..., None], np.asarray(alpha, dtype=float)
    z = (1 - k) * a * logs
    bracket = k * _relative(z) + (1 - k) * _relative_slope(z)
    return np.asarray(2 * (1 - k) * logs**2 * np.exp((k * a - 1) * logs) * bracket)


def stress_derivatives(mode: str, stretch: Array, moduli: ArrayLike, alpha: ArrayLike) -> Array:
    """Return derivatives (n, 2 terms) of the nominal stress at ``stretch`` (n,) by ``moduli``, then by ``alpha``."""
    basis, slope = stress_basis(mode, stretch, alpha), stress_basis_slope(mode, stretch, alpha)
    return np.concatenate([basis, slope * np.asarray(moduli)], axis=1)


def _relative(z: Array) -> Array:
    """Return (e^z - 1)/z, 1 at z = 0."""
    zero = z == 0
    return np.where(zero, 1.0, np.expm1(z) / np.where(zero, 1.0, z))


def _relative_slope(z: Array) -> Array:
    """Return the derivative of `_relative`, by its series where the closed form cancels."""
    small = np.abs(z) < 1e-2
    safe = np.where(small, 1.0, z)
    series = 1 / 2 + z * (1 / 3 + z * (1 / 8 + z * (1 / 30 + z / 144)))
    return np.where(small, series, (safe * np.exp(safe) - np.expm1(safe)) / safe**2)


def _mode(mode: str) -> float:
    if mode not in MODES:
        raise wrong_choice("test", mode, MODES)
    return MODES[mode]


def _stretches(stretch: ArrayLike) -> Array:
    values = np.asarray(stretch, dtype=float)
    wrong = ~(np.isfinite(values) & (values > 0))
    if wrong.any():
        raise InputError(f"stretch {values[wrong].flat[0]:g}: a stretch is deformed over undeformed length, above zero")
    return values

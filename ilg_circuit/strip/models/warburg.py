"""Diffusion of finite length before a reflecting wall: the finite Warburg element, behind a series resistance.

Zp = Rs + Rw coth(sqrt(s tau))/sqrt(s tau)
Rw coth(sqrt(s tau))/sqrt(s tau) = (Rw/tau) [1/s + sum over k >= 1 of 2/(s + (k pi)^2/tau)]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, ComplexArray
from ...fit.parameter import Parameter
from ..ladder import LADDER_ERROR, ORDER, Ladder, Ladders, enough, gauss, require_ladders, shares
from ..port import Port
from .ladder_path import SCALED, LadderPath
from .model import LibraryText, Pair, Shown
from .starts import amounts, scattered

WARBURG_RESISTANCE = Parameter("warburg_resistance", "Rw", "ohm", "diffusion, finite length, reflecting")
DIFFUSION_TIME = Parameter("diffusion_time", "tau", "s", "length^2/diffusion coefficient; capacitance tau/Rw")
#: Number of modes that are treated individually; higher ones are a continuum.
_DISCRETE_MODES = 1000
#: Largest growth of a diffusion time beyond its starting value that its ladder covers.
_REACH = 3.0


@dataclass(frozen=True)
class Warburg(LadderPath):
    """A series resistance and a finite Warburg element."""

    name = "warburg"
    title = "Warburg element"
    name_in_tables = "Warburg"
    equation = "Z = Re + Rdc || (Rs + Rw coth(sqrt(s tau))/sqrt(s tau))"
    constants = (WARBURG_RESISTANCE, DIFFUSION_TIME)
    material = (DIFFUSION_TIME,)
    auto = ("record", "spectrum")
    below_band = True  # the slow modes are all in its ladder
    library_parameters = ("dynamic_resistivity", "permittivity", "diffusion_time")
    library_note = "another diffusion_time moves the band as 1/tau"

    def element(self, values: Array, s: ComplexArray) -> ComplexArray:
        return warburg_impedance(s, values[:, :1], values[:, 1:])

    def ladder(self, constants: Sequence[float], ladders: Ladders) -> Ladder:
        """Return the ladder; ladders of equal ``reach`` and ``sections`` are scaled copies, so that fits are smooth."""
        require_ladders(ladders)
        resistance, tau = constants
        low, high = ladders.band
        product = 2 * np.pi * high * tau if ladders.reach is None else ladders.reach
        # rounded up to a decade, so that similar strips share one ladder
        decade = max(math.ceil(math.log10(product) - 1e-9), 1)
        lowest = 10.0 ** min(math.floor(math.log10(2 * np.pi * low * tau)), decade - 1)
        unit = _unit_ladder(decade, lowest, ladders.sections)
        farad = tau / resistance
        scaled = tuple((resistance * r, farad * c) for r, c in unit.sections)
        total, whole = resistance * unit.resistance, farad * unit.capacitance
        return Ladder(self, (resistance, tau), total, whole, scaled, ladders.band)

    def ladders(self, typical: Sequence[float], band: tuple[float, float]) -> Ladders:
        ladders = Ladders(band, reach=2 * np.pi * band[1] * typical[2] * _REACH)
        return replace(ladders, sections=len(self.ladder(typical[1:], ladders).sections))

    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        series, resistance, tau = values
        return {"dynamic_resistivity": series, "permittivity": tau / resistance, "diffusion_time": tau}

    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        tau = constants["diffusion_time"]
        return constants["dynamic_resistivity"], tau / constants["permittivity"], tau

    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        """Return starts from the slowest branch: a diffusing admittance has the time constant 4 tau/pi^2."""
        tau = np.pi**2 / 4 * max(r * c for r, c in pairs)
        return [1 / sum(1 / r for r, _ in pairs), tau / sum(c for _, c in pairs), tau]

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        s = 1j * omega

        def start(ions: ComplexArray, place: float) -> list[float]:
            tau = float((0.3 / omega[-1]) ** (1 - place) * (30 / omega[0]) ** place)
            return [*amounts(np.column_stack([np.ones_like(s), warburg_impedance(s, 1.0, tau)]), ions), tau]

        return scattered(z, random, start)

    def derived(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        return {"diffusion_capacitance": (values[2] / values[1], "F")}

    def shown_element(self, constants: Sequence[float]) -> list[Shown]:
        resistance, tau = constants
        return [
            ("warburg_resistance", resistance, "ohm", "Z = Rw coth(sqrt(s tau))/sqrt(s tau), Rw = tau/C"),
            ("diffusion_time", tau, "s", "tau"),
            ("capacitance", tau / resistance, "F", "EC (14): C = eps L w/b"),
        ]

    def library(self, port: Port, area_over_thickness: float) -> LibraryText:
        """Return the ladder's text. Sections keep proportions: resistances go with Rw = tau/C, capacitances with C."""
        ladder = port.ladder
        assert ladder is not None
        ohm, tau = ladder.constants
        farad = tau / ohm
        return LibraryText(
            SCALED | {"rdiffusion": "diffusion_time/cion1"},
            tuple((f"{r / ohm!r}*rdiffusion", f"{c / farad!r}*cion1") for r, c in ladder.sections),
            f"rion1+{ladder.resistance / ohm!r}*rdiffusion",
            f"{ladder.capacitance / farad!r}*cion1",
        )


WARBURG = Warburg()


def warburg_impedance(s: ArrayLike, resistance: float | Array, time_constant: float | Array) -> ComplexArray:
    """Return Rw coth(sqrt(s tau))/sqrt(s tau) [ohm]: finite length, reflecting."""
    return coth_over(np.sqrt(np.asarray(s, dtype=complex) * time_constant), resistance)


def coth_over(x: ComplexArray, resistance: float | Array) -> ComplexArray:
    """Return Rw coth(x)/x; by exponentials that cannot overflow, Re x >= 0."""
    return np.asarray(resistance * (1 + np.exp(-2 * x)) / (-np.expm1(-2 * x)) / x)


@lru_cache(maxsize=64)
def _unit_ladder(decade: int, lowest: float, sections: int | None) -> Ladder:
    """Return the ladder for Rw = 1 ohm, tau = 1 s and angular frequencies from ``lowest`` to 10^decade rad/s."""
    highest = 10.0**decade
    band = (lowest / (2 * np.pi), highest / (2 * np.pi))
    rates, weights, rest = _modes(highest * LADDER_ERROR ** (-2 / 3))

    def made(count: int) -> Ladder:
        nodes, masses = _gathered(rates, weights, count)
        pairs = tuple((float(w / x), float(1 / w)) for x, w in zip(nodes, masses, strict=True))
        return Ladder(WARBURG, (1.0, 1.0), rest, 1.0, pairs, band)

    return enough(made, sections, 4, 1)


def _modes(highest: float) -> tuple[Array, Array, float]:
    """Return rates, weights of the unit element's relaxations up to ``highest`` [rad/s], resistance of the others."""
    last = math.sqrt(highest) / math.pi
    k = np.arange(1, min(_DISCRETE_MODES, max(int(last), 1)) + 1, dtype=float)
    rates, weights = (k * np.pi) ** 2, np.full(len(k), 2.0)
    start = k[-1] + 0.5
    if last > start:  # midpoints of a fine logarithmic grid stand for the continuum of mode numbers
        edges = np.geomspace(start, last, int(200 * math.log10(last / start)) + 2)
        rates = np.concatenate([rates, np.pi**2 * edges[:-1] * edges[1:]])
        weights = np.concatenate([weights, 2 * np.diff(edges)])
        start = last
    return rates, weights, 2 / (np.pi**2 * start)


def _gathered(rates: Array, weights: Array, sections: int) -> tuple[Array, Array]:
    """Return at most ``sections`` relaxations for many, by Gauss quadrature on blocks of equal ratio."""
    blocks = -(-sections // ORDER)
    edges = np.geomspace(rates[0] * 0.999, rates[-1] * 1.001, blocks + 1)
    nodes, masses = [], []
    for k, order in enumerate(shares(sections, blocks)):
        inside = (rates >= edges[k]) & (rates < edges[k + 1])
        if inside.any():
            x, w = gauss(rates[inside], weights[inside], order)
            nodes.append(x)
            masses.append(w)
    return np.concatenate(nodes), np.concatenate(masses)

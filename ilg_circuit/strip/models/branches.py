"""R-C branches in parallel: rc (the paper's, EC (1)), rc2, rc3.

Zp = 1/(sum over k of 1/(Rk + 1/(Ck s)))
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...arrays import Array, ComplexArray
from ...errors import InputError
from ...fit.parameter import Parameter
from ..ladder import Ladders
from ..port import Port
from .model import IonPath, LibraryText, Pair, Shown
from .starts import SETS, amounts


def branch_endings(count: int) -> list[str]:
    """Return the suffixes of the keys in [material] of each branch: none, ``_2``, ``_3``."""
    return ["", *(f"_{k}" for k in range(2, count + 1))]


@dataclass(frozen=True)
class Branches(IonPath):
    """A number of R-C branches in the order of ascending time constants."""

    count: int

    auto = ("record", "spectrum")
    grows = True

    @property
    def name(self) -> str:
        return "rc" if self.count == 1 else f"rc{self.count}"

    @property
    def equation(self) -> str:
        if self.count == 1:
            return "EC (1): Z = Re + Rdc || (Rd + 1/(C s))"
        return f"Z = Re + Rdc || (R1 + 1/(C1 s)) || ... ({self.count} branches)"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        symbols = [("Rd", "C")] if self.count == 1 else [(f"R{k}", f"C{k}") for k in range(1, self.count + 1)]
        found = []
        for (r, c), (resistance, capacitance) in zip(symbols, self._names, strict=True):
            found.append(Parameter(resistance, r, "ohm", "ion path, EC (13)"))
            found.append(Parameter(capacitance, c, "F", "ion path, EC (14)"))
        return tuple(found)

    @property
    def _names(self) -> list[tuple[str, str]]:
        if self.count == 1:
            return [("dynamic_resistance", "capacitance")]
        return [(f"resistance{end}", f"capacitance{end}") for end in self._endings]

    @property
    def _endings(self) -> list[str]:
        return [""] if self.count == 1 else [f"_{k}" for k in range(1, self.count + 1)]

    @property
    def branch_counts(self) -> tuple[int, ...]:
        return (self.count,)

    def impedance(self, values: Array, s: ComplexArray) -> ComplexArray:
        r, c = values[:, 0::2, None], values[:, 1::2, None]
        return np.asarray(1 / (c * s / (1 + r * c * s)).sum(axis=1))

    def port(self, dc_resistance: float, values: Sequence[float], ladders: Ladders) -> Port:
        return Port(dc_resistance, tuple(self.pairs(values)))

    def values(self, port: Port) -> tuple[float, ...]:
        if len(port.branches) != self.count:
            raise InputError(f"the port is not one of model {self.name}")
        return tuple(x for pair in port.branches for x in pair)

    def pairs(self, values: Sequence[float]) -> list[Pair]:
        return list(zip(values[0::2], values[1::2], strict=True))

    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        return dict(zip(self.library_parameters, values, strict=True))

    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        return tuple(constants[key] for key in self.library_parameters)

    def order(self, values: Array) -> np.ndarray:
        ranks = np.argsort(values[0::2] * values[1::2])
        return np.column_stack([2 * ranks, 2 * ranks + 1]).ravel()

    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        return [x for pair in pairs for x in pair]

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        """Return Y = 1/Rdc + sum of C s/(1 + tau s), linear in 1/Rdc and every C once the time constants are given."""
        s, low, high = 1j * omega[:, None], np.log(0.3 / omega[-1]), np.log(10 / omega[0])
        found = []
        for _ in range(SETS):
            tau = np.exp(np.sort(random.uniform(low, high, self.count)))
            columns = np.concatenate([np.ones_like(s), s / (1 + s * tau)], axis=1)
            g, *c = amounts(columns, np.asarray(1 / z))
            found.append([1 / g, *(x for t, ck in zip(tau, c, strict=True) for x in (t / ck, ck))])
        return np.array(found)

    def pooled_starts(self, pairs: Sequence[Pair]) -> list[list[float]]:
        if self.count == 1:
            return []
        ranked = sorted(pairs, key=lambda pair: pair[0] * pair[1])
        return [[x for pair in chosen for x in pair] for chosen in combinations(ranked, self.count)]

    def derived(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        pairs = self.pairs(values)
        found = {f"time_constant{e}": (r * c, "s") for e, (r, c) in zip(self._endings, pairs, strict=True)}
        return found | ({"total_capacitance": (sum(c for _, c in pairs), "F")} if len(pairs) > 1 else {})

    def shown(self, port: Port) -> list[Shown]:
        rows = []
        for (r_name, c_name), ending, (r, c) in zip(self._names, self._endings, port.branches, strict=True):
            rows += [
                (r_name, r, "ohm", "EC (13): Rd = rho_d b/(L w)"),
                (c_name, c, "F", "EC (14): C = eps L w/b"),
                (f"time_constant{ending}", r * c, "s", "Rd C"),
            ]
        return rows

    def library(self, port: Port, area_over_thickness: float) -> LibraryText:
        derived = {}
        for k, ending in enumerate(branch_endings(self.count), 1):
            derived[f"rion{k}"] = f"dynamic_resistivity{ending}*thickness/area"
            derived[f"cion{k}"] = f"permittivity{ending}*area/thickness"
        return LibraryText(derived, tuple((f"rion{k}", f"cion{k}") for k in range(1, self.count + 1)))

    @property
    def library_parameters(self) -> tuple[str, ...]:
        endings = branch_endings(self.count)
        return tuple(f"{key}{ending}" for ending in endings for key in ("dynamic_resistivity", "permittivity"))


RC, RC2, RC3 = (Branches(count) for count in (1, 2, 3))

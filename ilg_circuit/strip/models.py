"""The electrical models by name: what each is made of, its equation, and the port that its parameters make.

One list for all uses: a fit takes its parameters' names and limits from here, simulation and export the port, a
spectrum its impedance. A name is an ion path, and after a + what else is not ohmic: ``rc2``, ``warburg+sinh``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from ..errors import InputError
from ..fit.parameter import Parameter
from .ladder import LADDER_BAND, cpe_ladder, warburg_ladder
from .port import Port


@dataclass(frozen=True)
class Ladders:
    """How ladders are made: ``band`` [Hz], number of ``sections``, ``reach``; see `ilg_circuit.strip.ladder`."""

    band: tuple[float, float] = LADDER_BAND
    sections: int | None = None
    reach: float | None = None


@dataclass(frozen=True)
class ElectricalModel:
    """A model of the electrical port. ``parameters`` are in the order in which `port` takes their values."""

    name: str
    equation: str
    parameters: tuple[Parameter, ...]
    _ions: Callable[[tuple[float, ...], Ladders], Port]
    _ion_count: int

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @property
    def linear(self) -> bool:
        return len(self.parameters) == self._ion_count

    def port(self, values: Sequence[float], electrode_resistance: float = 0.0, ladders: Ladders | None = None) -> Port:
        """The port that ``values`` (SI, in the order of ``parameters``) make.

        Raises InputError for a wrong number of values, or one that is not positive or beyond its limit.
        """
        if len(values) != len(self.parameters):
            raise InputError(f"model {self.name} takes {len(self.parameters)} values, not {len(values)}")
        for parameter, value in zip(self.parameters, values, strict=True):
            if not (math.isfinite(value) and 0 < value < parameter.upper):
                limit = f" and less than {parameter.upper:g}" if math.isfinite(parameter.upper) else ""
                raise InputError(f"{parameter.name} is {value:g} {parameter.unit}; it must be more than zero{limit}")
        port = self._ions(tuple(values[: self._ion_count]), ladders or Ladders())
        extra = dict(zip(self.names[self._ion_count :], values[self._ion_count :], strict=True))
        fields = {name: getattr(port, name) for name in Port.__dataclass_fields__}
        return Port(**(fields | {"electrode_resistance": electrode_resistance} | extra))

    # -- shim --
    @property
    def plain(self):
        return self.name.split("+")[0]

    auto = True

    @property
    def needs_several_voltages(self):
        return tuple(n for n in ("emission_voltage", "capacitance_slope") if n in self.names)

    @property
    def constant_voltage_hides(self):
        return tuple(n for n in ("emission_voltage",) if n in self.names)

    @property
    def branch_count(self):
        return {"rc": 1, "rc2": 2, "rc3": 3}.get(self.plain, 3)

    def impedance(self, values, s, electrode_resistance=0.0):
        import numpy as np

        from .ladder import Ladder

        columns = values.T[:, :, None]
        dc, rest = columns[0], columns[1:]
        port = Port
        ladder = Ladder
        if self.name in ("warburg", "cpe"):
            bare = ladder(self.name, (rest[1], rest[2]), 0.0, np.inf, (), (0.0, 0.0), np.inf)
            made = port(dc, electrode_resistance=electrode_resistance, ladder=bare, series_resistance=rest[0])
        else:
            made = port(dc, tuple(zip(rest[0::2], rest[1::2], strict=True)), electrode_resistance)
        with np.errstate(all="ignore"):
            return np.asarray(made.impedance(s, ideal=True))

    def order(self, values):
        import numpy as np

        n = len(values)
        index = np.arange(n)
        if self.plain in ("rc2", "rc3"):
            b = int(self.plain[2])
            o = np.argsort(np.asarray(values)[1 : 2 * b + 1].reshape(-1, 2).prod(axis=1))
            index[1 : 2 * b + 1] = np.concatenate([[2 * k + 1, 2 * k + 2] for k in o])
        return index

    def ladders(self, typical, band):
        from dataclasses import replace

        import numpy as np

        low, high = band
        v = dict(zip(self.names, typical.tolist(), strict=True))
        if "diffusion_time" in v:
            l = Ladders((low, high), reach=2 * np.pi * high * v["diffusion_time"] * 3.0)
        elif "cpe_exponent" in v:
            l = Ladders((low, high))
        else:
            return Ladders()
        return replace(l, sections=len(self.port(typical.tolist(), ladders=l).ladder.sections))

    def spectrum_starts(self, z, omega, random):
        from types import SimpleNamespace

        from ..identify.spectrum_start import starts

        return starts(self, SimpleNamespace(impedance=z, frequency=omega / (2 * math.pi)), 0.0, random)

    def derived(self, values):
        v = dict(zip(self.names, [float(x) for x in values], strict=True))
        d = {}
        pairs = [(v[f"resistance_{k}"], v[f"capacitance_{k}"]) for k in (1, 2, 3) if f"resistance_{k}" in v] or (
            [(v["dynamic_resistance"], v["capacitance"])] if "capacitance" in v else []
        )
        for k, (r, c) in enumerate(pairs, 1):
            d["time_constant" + (f"_{k}" if len(pairs) > 1 else "")] = (r * c, "s")
        if "diffusion_time" in v:
            d["diffusion_capacitance"] = (v["diffusion_time"] / v["warburg_resistance"], "F")
        if len(pairs) > 1:
            d["total_capacitance"] = (sum(c for _, c in pairs), "F")
        return d

    def values(self, port: Port) -> tuple[float, ...]:
        """The parameters' values in a ``port`` of this model: the inverse of `port`."""
        known: dict[str, float] = {
            "dc_resistance": port.dc_resistance,
            "series_resistance": port.series_resistance,
            "capacitance_slope": port.capacitance_slope,
        }
        if port.emission_voltage is not None:
            known["emission_voltage"] = port.emission_voltage
        for k, (r, c) in enumerate(port.branches, 1):
            known |= {f"resistance_{k}": r, f"capacitance_{k}": c}
            if len(port.branches) == 1:
                known |= {"dynamic_resistance": r, "capacitance": c}
        if port.ladder is not None:
            warburg = ("warburg_resistance", "diffusion_time")
            names = warburg if port.ladder.law == "warburg" else ("cpe_coefficient", "cpe_exponent")
            known |= dict(zip(names, port.ladder.constants, strict=True))
        if not set(self.names) <= set(known):
            raise InputError(f"the port is not one of model {self.name}")
        return tuple(known[name] for name in self.names)


def electrical_model(name: str) -> ElectricalModel:
    """The model of that name. Raises InputError that lists what there is."""
    ions, *additions = name.split("+")
    if ions not in _IONS or len(set(additions)) < len(additions) or any(a not in _ADDITIONS for a in additions):
        raise InputError(f"model is '{name}'; choose one of {', '.join(model_names())}")
    if "growing" in additions and ions in ("warburg", "cpe"):
        raise InputError(f"model is '{name}'; 'growing' goes with rc, rc2 and rc3")
    return _composed(ions, tuple(sorted(additions)))


def model_names() -> tuple[str, ...]:
    """Every name that `electrical_model` knows, simple ones first."""
    plain = tuple(_IONS)
    added = tuple(f"{ions}+{a}" for a in _ADDITIONS for ions in _IONS if not (a == "growing" and ions in _LADDERS))
    return plain + added


@lru_cache
def _composed(ions: str, additions: tuple[str, ...]) -> ElectricalModel:
    equation, parameters, make = _IONS[ions]
    for addition in additions:
        equation += "; " + _ADDITIONS[addition][0]
    extra = tuple(_ADDITIONS[addition][1] for addition in additions)
    return ElectricalModel("+".join((ions, *additions)), equation, (*parameters, *extra), make, len(parameters))


_RDC = Parameter("dc_resistance", "Rdc", "ohm", "electron path, EC (12)")


def _branches(count: int) -> tuple[str, tuple[Parameter, ...], Callable[[tuple[float, ...], Ladders], Port]]:
    if count == 1:
        equation = "EC (1): Z = Re + Rdc || (Rd + 1/(C s))"
        pairs = [("dynamic_resistance", "Rd", "capacitance", "C")]
    else:
        equation = f"Z = Re + Rdc || (R1 + 1/(C1 s)) || ... ({count} branches)"
        pairs = [(f"resistance_{k}", f"R{k}", f"capacitance_{k}", f"C{k}") for k in range(1, count + 1)]
    parameters = [_RDC]
    for r, r_symbol, c, c_symbol in pairs:
        parameters += [
            Parameter(r, r_symbol, "ohm", "ion path, EC (13)"),
            Parameter(c, c_symbol, "F", "ion path, EC (14)"),
        ]

    def make(values: tuple[float, ...], _: Ladders) -> Port:
        return Port(values[0], tuple(zip(values[1::2], values[2::2], strict=True)))

    return equation, tuple(parameters), make


def _warburg(values: tuple[float, ...], ladders: Ladders) -> Port:
    dc, series, resistance, time_constant = values
    ladder = warburg_ladder(resistance, time_constant, ladders.band, ladders.sections, ladders.reach)
    return Port(dc, ladder=ladder, series_resistance=series)


def _cpe(values: tuple[float, ...], ladders: Ladders) -> Port:
    dc, series, coefficient, exponent = values
    return Port(dc, ladder=cpe_ladder(coefficient, exponent, ladders.band, ladders.sections), series_resistance=series)


_SERIES = Parameter("series_resistance", "Rs", "ohm", "before the diffusing ions")
_LADDERS = ("warburg", "cpe")
_IONS = {
    "rc": _branches(1),
    "rc2": _branches(2),
    "rc3": _branches(3),
    "warburg": (
        "Z = Re + Rdc || (Rs + Rw coth(sqrt(s tau))/sqrt(s tau))",
        (
            _RDC,
            _SERIES,
            Parameter("warburg_resistance", "Rw", "ohm", "diffusion, finite length, reflecting"),
            Parameter("diffusion_time", "tau", "s", "length^2/diffusion coefficient; capacitance tau/Rw"),
        ),
        _warburg,
    ),
    "cpe": (
        "Z = Re + Rdc || (Rs + 1/(Q s^a))",
        (
            _RDC,
            _SERIES,
            Parameter("cpe_coefficient", "Q", "F s^(a-1)", "constant phase element"),
            Parameter("cpe_exponent", "a", "", "constant phase element: 1 a capacitor, 1/2 diffusion", upper=1.0),
        ),
        _cpe,
    ),
}
_ADDITIONS = {
    "sinh": (
        "electron path i = (Vt/Rdc) sinh(v/Vt)",
        Parameter("emission_voltage", "Vt", "V", "electron path, two antiparallel diodes"),
    ),
    "growing": (
        "q = C (v + k v abs(v)/2)",
        Parameter("capacitance_slope", "k", "1/V", "growth of the capacitance with voltage, relative to it"),
    ),
}


def candidates(kinds):
    return ("rc", "rc2", "rc3", "warburg", *(("cpe",) if "spectrum" in kinds else ()))

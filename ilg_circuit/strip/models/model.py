"""Electrical models: an ion path in parallel with the electron path, and additions that are not ohmic resistors.

    Z(s) = Re + 1/(1/Rdc + 1/Zp(s))

An `IonPath` gives Zp and everything that depends on it: parameters, realisation as a port, constants of the material,
starting values, text of an exported library, and the rows of ``show`` and of the table of assumptions. An `Addition`
makes the electron path, the capacitances or the terminals more than linear resistors and capacitors. Values of an ion
path are in the order of its ``parameters``, SI units; sets of values are arrays (m, n).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...arrays import Array, ComplexArray
from ...errors import InputError
from ...fit.parameter import Parameter
from ..ladder import Ladders
from ..port import Port

#: Name, value, SI unit and equation of one element, as ``show`` lists them.
Shown = tuple[str, float, str, str]
#: Name of an assumption, its number, the largest number at which it holds, and the consequence if it fails.
Assumed = tuple[str, float, float, str]
#: Resistance [ohm] and capacitance [F] of a relaxation.
Pair = tuple[float, float]

RDC = Parameter("dc_resistance", "Rdc", "ohm", "electron path, EC (12)")


@dataclass(frozen=True)
class LibraryText:
    """SPICE expressions of the ion path in an exported library.

    ``derived`` maps names to expressions of the subcircuit's parameters and earlier names; ``sections`` are the
    resistance and capacitance of each branch or ladder section; ``resistance`` and ``capacitance`` those in series with
    a ladder's sections, empty for branches.
    """

    derived: Mapping[str, str]
    sections: tuple[tuple[str, str], ...]
    resistance: str = ""
    capacitance: str = ""


class IonPath(ABC):
    """The path of the ions in an electrical model: one subclass for each kind, usually without fields.

    ``library_note`` is the remark on a ladder's range in the header of a library.
    ``material`` are the keys in the section [material] of a strip's file that this path has beyond
    ``dynamic_resistivity`` and ``permittivity``; the set of them names the path. ``auto`` are the kinds of data,
    "record" and "spectrum", for which ``--model auto`` tries it, in the order of the registry. ``grows`` says whether
    its capacitances may grow with voltage, ``stores`` whether it holds charge at rest.
    """

    material: tuple[Parameter, ...] = ()
    auto: tuple[str, ...] = ()
    grows: bool = False
    stores: bool = True
    library_note: str = "the constants of the model are fixed"

    @property
    @abstractmethod
    def name(self) -> str:
        """Return the name in commands and files."""

    @property
    @abstractmethod
    def equation(self) -> str:
        """Return the impedance of the whole port as text."""

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the ion path, without Rdc."""

    @abstractmethod
    def impedance(self, values: Array, s: ComplexArray) -> ComplexArray:
        """Return Zp [ohm] (m, f) near 0 V of sets of ``values`` (m, n) at ``s`` (f,) [rad/s]."""

    @abstractmethod
    def port(self, dc_resistance: float, values: Sequence[float], ladders: Ladders) -> Port:
        """Return the port with this ion path; no electrodes, all of it linear."""

    @abstractmethod
    def values(self, port: Port) -> tuple[float, ...]:
        """Return the values in a ``port`` of this path: the inverse of `port`. Raises InputError for another."""

    @abstractmethod
    def to_material(self, values: Sequence[float]) -> dict[str, float]:
        """Return the constants of the material by key, in circuit units (ohm for ohm m, F for F/m).

        ``dynamic_resistivity`` and ``permittivity`` are always among them; further branches end in ``_2``, ``_3``.
        """

    @abstractmethod
    def from_material(self, constants: Mapping[str, float]) -> tuple[float, ...]:
        """Return the values: the inverse of `to_material`."""

    @abstractmethod
    def starts_from_branches(self, pairs: Sequence[Pair]) -> list[float]:
        """Return starting values from the relaxations of a record, by ascending time constant."""

    @abstractmethod
    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        """Return starting values (m, n + 1), Rdc first, for a spectrum ``z`` (f,) [ohm] at ``omega`` (f,) [rad/s]."""

    @abstractmethod
    def shown(self, port: Port) -> list[Shown]:
        """Return the rows that ``show`` lists."""

    @property
    def branch_counts(self) -> tuple[int, ...]:
        """Return the numbers of relaxations that a fit's start looks for in a record, one after the other."""
        return 2, 1

    def order(self, values: Array) -> np.ndarray:
        """Return the index (n,) that puts interchangeable parts in ascending order of their time constants."""
        return np.arange(len(values))

    def ladders(self, typical: Sequence[float], band: tuple[float, float]) -> Ladders:
        """Return the design of ladders for a fit from ``typical``, so that they differ in their values only."""
        return Ladders(band)

    def derived(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        """Return quantities derived from the values: name -> value, unit."""
        return {}

    def pooled_starts(self, pairs: Sequence[Pair]) -> list[list[float]]:
        """Return starting values from the relaxations that fits of several data sets found together."""
        return []

    def pairs(self, values: Sequence[float]) -> list[Pair]:
        """Return the branches that the values are, if they are branches."""
        return []

    def assumptions(self, port: Port, band: tuple[float, float]) -> list[Assumed]:
        """Return the rows of the table of assumptions for use over ``band`` [Hz]."""
        return []

    def library(self, port: Port, area_over_thickness: float) -> LibraryText:
        """Return the text of an exported library; ``area_over_thickness`` [m] is L w/b of the strip as it is.

        Here the sizes alone are parameters, and the constants of the model stand as numbers.
        """

        def ohm(value: float) -> str:
            return f"{value * area_over_thickness!r}*thickness/area"

        def farad(value: float) -> str:
            return f"{value / area_over_thickness!r}*area/thickness"

        if port.ladder is None:
            return LibraryText({}, tuple((ohm(r), farad(c)) for r, c in port.branches))
        ladder = port.ladder
        sections = tuple((ohm(r), farad(c)) for r, c in ladder.sections)
        return LibraryText({}, sections, ohm(port.series_resistance + ladder.resistance), farad(ladder.capacitance))

    @property
    def library_parameters(self) -> tuple[str, ...]:
        """Return the keys of [material] that `library` uses as parameters."""
        return ()


class Addition:
    """An addition to a model's ion path, written after a ``+`` in its name.

    ``parameter`` is its one parameter, named as the `Port`'s field and the key in [material]; ``of`` says whether it
    changes the electrons, the ions or the terminals. ``linear``: a small signal about 0 V shows it.
    ``several_voltages``: no single voltage determines it; ``constant_voltage_hides``: a step shows nothing of it;
    ``spectra_only``: a record over time shows nothing of it; ``charges``: a law of the charge, of which there is one;
    ``of_either_sign``: a strip's value may be negative; ``contested``: ``--model auto`` tries it where voltages differ,
    and others only where no model describes the data well.
    """

    name: str
    equation: str
    parameter: Parameter
    of: str
    linear: bool = False
    several_voltages: bool = False
    constant_voltage_hides: bool = False
    spectra_only: bool = False
    charges: bool = False
    of_either_sign: bool = False
    contested: bool = True

    def goes_with(self, ions: IonPath) -> bool:
        """Return True if an ion path can have it."""
        return True

    def start(self, largest_voltage: float) -> float:
        """Return the starting value of a fit to records of up to ``largest_voltage`` [V]."""
        return largest_voltage

    def spectrum_start(self, z: ComplexArray, omega: Array) -> float:
        """Return the starting value of a fit to a spectrum."""
        raise InputError(f"a spectrum about 0 V does not show {self.parameter.name}")

    def in_series(self, values: Array, s: ComplexArray) -> ComplexArray:
        """Return the impedance [ohm] (m, f) that values (m,) of a linear addition put in series with the port."""
        return np.zeros((len(values), len(s)), dtype=complex)

    def shown(self, port: Port) -> list[Shown]:
        """Return the rows that ``show`` lists."""
        p = self.parameter
        return [(p.name, getattr(port, p.name), p.unit, self.equation)]


@dataclass(frozen=True)
class ElectricalModel:
    """A model of the electrical port. ``parameters`` are in the order in which `port` takes their values."""

    ions: IonPath
    additions: tuple[Addition, ...] = ()

    @cached_property
    def name(self) -> str:
        """Return the name: the ion path's, and every addition's after a ``+``."""
        return "+".join((self.plain, *(a.name for a in self.additions)))

    @property
    def plain(self) -> str:
        """Return the name of the model without additions."""
        return self.ions.name

    @property
    def equation(self) -> str:
        """Return the equations as text."""
        return "; ".join((self.ions.equation, *(a.equation for a in self.additions)))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return Rdc, the parameters of the ion path, the parameters of the additions."""
        return (RDC, *self.ions.parameters, *(a.parameter for a in self.additions))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @cached_property
    def material_keys(self) -> dict[str, Parameter]:
        """Return the keys in [material] that the model has beyond resistivities and permittivities, by name."""
        return {p.name: p for p in (*self.ions.material, *(a.parameter for a in self.additions))}

    @property
    def linear(self) -> bool:
        """Return True if small signals determine all parameters."""
        return all(a.linear for a in self.additions)

    @property
    def needs_several_voltages(self) -> tuple[str, ...]:
        """Return the names of parameters that no single voltage determines."""
        return tuple(a.parameter.name for a in self.additions if a.several_voltages)

    @property
    def constant_voltage_hides(self) -> tuple[str, ...]:
        """Return the names of parameters that a step of one voltage cannot show."""
        return tuple(a.parameter.name for a in self.additions if a.constant_voltage_hides)

    @property
    def spectra_only(self) -> tuple[str, ...]:
        """Return the names of parameters that only a spectrum can show."""
        return tuple(a.parameter.name for a in self.additions if a.spectra_only)

    @cached_property
    def _signed(self) -> tuple[bool, ...]:
        return tuple(
            any(a.of_either_sign and a.parameter.name == p.name for a in self.additions) for p in self.parameters
        )

    @cached_property
    def _split(self) -> int:
        return 1 + len(self.ions.parameters)

    def port(self, values: Sequence[float], electrode_resistance: float = 0.0, ladders: Ladders | None = None) -> Port:
        """Return the port that ``values`` (SI, in the order of ``parameters``) make.

        Raises InputError for a wrong number of values, or one that is not positive or beyond its limit.
        """
        if len(values) != len(self.parameters):
            raise InputError(f"model {self.name} takes {len(self.parameters)} values, not {len(values)}")
        for parameter, given, signed in zip(self.parameters, values, self._signed, strict=True):
            value = abs(given) if signed else given
            if not 0 < value < parameter.upper:
                limit = f" and less than {parameter.upper:g}" if math.isfinite(parameter.upper) else ""
                raise InputError(f"{parameter.name} is {value:g} {parameter.unit}; it must be more than zero{limit}")
        port = self.ions.port(values[0], tuple(values[1 : self._split]), ladders or Ladders())
        added: dict[str, Any] = dict(zip(self.names[self._split :], values[self._split :], strict=True))
        if not added and port.electrode_resistance == electrode_resistance:
            return port  # a search makes many thousand
        return replace(port, electrode_resistance=electrode_resistance, **added)

    def values(self, port: Port) -> tuple[float, ...]:
        """Return the values of the parameters in a ``port`` of this model: the inverse of `port`."""
        added = [getattr(port, a.parameter.name) for a in self.additions]
        if None in added:
            raise InputError(f"the port is not one of model {self.name}")
        return (port.dc_resistance, *self.ions.values(port), *added)

    def impedance(self, values: Array, s: ComplexArray, electrode_resistance: float = 0.0) -> ComplexArray:
        """Return Z [ohm] (m, f) of ``values`` (m, n) at ``s`` (f,) [rad/s], about 0 V, of ideal elements.

        The closed form EC (1), Re + Rdc || Zp: no ladder is made. Beyond the range of numbers it is not finite.
        """
        with np.errstate(all="ignore"):
            ions = self.ions.impedance(values[:, 1 : self._split], s)
            z = electrode_resistance + 1 / (1 / values[:, :1] + 1 / ions)
            for k, addition in enumerate(self.additions, self._split):
                if addition.linear:
                    z = z + addition.in_series(values[:, k], s)
        return np.asarray(z)

    def order(self, values: Array) -> np.ndarray:
        """Return the index (n,) that puts interchangeable parts of ``values`` (n,) in ascending time constant."""
        index = np.arange(len(self.parameters))
        index[1 : self._split] = 1 + self.ions.order(values[1 : self._split])
        return index

    def ladders(self, typical: Array, band: tuple[float, float]) -> Ladders:
        """Return ladders over ``band`` [Hz] whose structure stays the same while a fit varies parameters.

        ``typical`` (n,) are the values from which it starts.
        """
        return self.ions.ladders(tuple(typical[1 : self._split].tolist()), band)

    def starts_from_branches(self, dc: float, pairs: Sequence[Pair], largest_voltage: float) -> Array:
        """Return starting values (n,) from the relaxations of a record.

        ``dc`` is Rdc [ohm], ``pairs`` are (R [ohm], C [F]) by ascending time constant, ``largest_voltage`` [V] is that
        of the drive.
        """
        added = [a.start(largest_voltage) for a in self.additions]
        return np.array([dc, *self.ions.starts_from_branches(pairs), *added])

    def spectrum_starts(self, z: ComplexArray, omega: Array, random: np.random.Generator) -> Array:
        """Return starting values (m, n) for a spectrum ``z`` (f,) [ohm], Re taken off, at ``omega`` (f,) [rad/s]."""
        s: ComplexArray = np.asarray(1j * omega, dtype=complex)
        added = [a.spectrum_start(z, omega) for a in self.additions]
        for addition, value in zip(self.additions, added, strict=True):
            z = np.asarray(z - addition.in_series(np.array([value]), s)[0])
        sets = self.ions.spectrum_starts(z, omega, random)
        return np.column_stack([sets, np.tile(added, (len(sets), 1))])

    def pairs(self, values: Sequence[float]) -> list[Pair]:
        """Return the (R [ohm], C [F]) of the branches; none for other ion paths."""
        return self.ions.pairs(values[1 : self._split])

    def pooled_starts(self, pairs: Sequence[Pair]) -> list[dict[str, float]]:
        """Return sets of ion-path parameters by name, from relaxations that several fits found."""
        names = self.names[1 : self._split]
        return [dict(zip(names, values, strict=True)) for values in self.ions.pooled_starts(pairs)]

    def derived(self, values: Sequence[float]) -> dict[str, tuple[float, str]]:
        """Return quantities derived from ``values`` (n,): name -> value, unit."""
        return self.ions.derived(values[1 : self._split])

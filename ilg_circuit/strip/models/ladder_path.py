"""An ion path of a series resistance and an element approximated by a ladder: diffusion, constant phase, arcs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...arrays import Array, ComplexArray
from ...errors import InputError
from ...fit.parameter import Parameter
from ..ladder import ORDER, Ladder, Ladders, Relaxations, enough, gathered, require_ladders
from ..port import Port
from .model import Assumed, IonPath, Shown

#: Expressions in a library whose sections keep their proportions: series resistance and capacitance of the strip.
SCALED = {"rion1": "dynamic_resistivity*thickness/area", "cion1": "permittivity*area/thickness"}
SERIES = Parameter("series_resistance", "Rs", "ohm", "before the diffusing ions")


class LadderPath(IonPath):
    """An ion path of a series resistance and an element approximated by a ladder.

    A subclass gives the closed form of the element as `element`, and its constants' way to the material. ``title`` is
    what texts call the element; ``below_band`` says whether the ladder holds below its band too.
    """

    title: str
    below_band: bool = False

    @property
    @abstractmethod
    def constants(self) -> tuple[Parameter, ...]:
        """Return the parameters of the element."""

    @abstractmethod
    def element(self, values: Array, s: ComplexArray) -> ComplexArray:
        """Return the impedance [ohm] (m, f) of the element for sets of its constants ``values`` (m, k)."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (SERIES, *self.constants)

    def impedance(self, values: Array, s: ComplexArray) -> ComplexArray:
        return np.asarray(values[:, :1] + self.element(values[:, 1:], s))

    def relaxations(self, constants: Sequence[float]) -> Relaxations:
        """Return the ideal element of its ladder; not needed if `ladder` is overridden."""
        return Relaxations(lambda s: np.asarray(self.element(np.array([constants]), s)[0]))

    def ladder(self, constants: Sequence[float], ladders: Ladders) -> Ladder:
        """Return the ladder of the element. Raises InputError for a band or a number of sections that cannot be."""
        require_ladders(ladders)
        relaxations = self.relaxations(constants)

        def made(sections: int) -> Ladder:
            found = gathered(relaxations, ladders.band, sections)
            return Ladder(self, tuple(constants), *found, ladders.band)

        return enough(made, ladders.sections, ORDER, ORDER)

    def port(self, dc_resistance: float, values: Sequence[float], ladders: Ladders) -> Port:
        return Port(dc_resistance, ladder=_ladder(self, tuple(values[1:]), ladders), series_resistance=values[0])

    def values(self, port: Port) -> tuple[float, ...]:
        if port.ladder is None or port.ladder.ions != self:
            raise InputError(f"the port is not one of model {self.name}")
        return (port.series_resistance, *port.ladder.constants)

    def ladders(self, typical: Sequence[float], band: tuple[float, float]) -> Ladders:
        ladders = Ladders(band)
        return replace(ladders, sections=len(self.ladder(typical[1:], ladders).sections))

    def shown(self, port: Port) -> list[Shown]:
        ladder = port.ladder
        assert ladder is not None
        low, high = ladder.band
        return [
            (SERIES.name, port.series_resistance, "ohm", "EC (13): Rs = rho_d b/(L w)"),
            *self.shown_element(ladder.constants),
            ("ladder_sections", float(len(ladder.sections)), "", "R parallel C sections that realise it"),
            ("ladder_error", ladder.error, "", f"its largest error from {low:g} to {high:g} Hz"),
        ]

    def shown_element(self, constants: Sequence[float]) -> list[Shown]:
        """Return the rows of ``show`` for the element."""
        return [(p.name, value, p.unit, p.meaning) for p, value in zip(self.constants, constants, strict=True)]

    def assumptions(self, port: Port, band: tuple[float, float]) -> list[Assumed]:
        ladder = port.ladder
        assert ladder is not None
        low, high = ladder.band
        beyond = max(0.0 if self.below_band else low / band[0], band[1] / high)
        return [
            (f"{self.name_in_tables} ladder's error", ladder.error, 0.01,
             "more ladder_sections, or a narrower band, needed"),
            (f"band of use over the {self.name_in_tables} ladder's", beyond, 1.0 + 1e-6,
             f"beyond {low:g} Hz to {high:g} Hz the ladder is no {self.title}; widen ladder_lowest and ladder_highest"),
        ]  # fmt: skip

    @property
    def name_in_tables(self) -> str:
        """Return the short name of the element in the table of assumptions."""
        return self.name


@lru_cache(maxsize=64)
def _ladder(ions: LadderPath, constants: tuple[float, ...], ladders: Ladders) -> Ladder:
    """Return the ladder of ``ions``; a strip's is needed for its netlist, its impedance and its description alike."""
    return ions.ladder(constants, ladders)

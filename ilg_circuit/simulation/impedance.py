"""Computes the impedance that a strip shows at its terminals, over frequency and about a bias voltage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray, plain
from ..circuit.line_response import line_response
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..circuit.wiring import joined, wiring
from ..errors import InputError
from ..result import Column, Result
from ..solve.spectrum import spectrum
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from ..strip.ladder import Ladder
from ..strip.models import LadderPath
from ..units import format_quantity
from .response import line_of

if TYPE_CHECKING:
    from .check import Difference


@dataclass(frozen=True, repr=False, eq=False)
class Impedance(Result):
    """The small-signal impedance of a strip over frequency, as `ilg_circuit.impedance` returns it.

    Attributes
    ----------
    frequency : ndarray (f,)
        Frequencies [Hz].
    impedance : ndarray (f,), complex
        Impedance at the terminals [ohm].
    port : ndarray (f,), complex
        Closed form of the electrical side alone [ohm], EC (1); of a line of cells by its nodes. The difference is
        reflected by the motion.
    bias : float
        Voltage about which the signal is small [V].
    actuator : Actuator
        The strip.
    engine : str
        Name of the solver.
    ladder : Ladder or None
        The ladder that realises a Warburg element or a CPE.
    segment : int or None
        Segment of a strip with electrodes at which it is seen, all others at 0 V; None for all joined.
    cells_error : float
        Estimated error by the size of the cells of a strip with electrodes.
    checks : tuple of Difference
        Differences from other solutions, if ``check=True`` was asked for.
    """

    presenter: ClassVar[str] = "impedance"
    actuator: Actuator
    frequency: Array
    impedance: ComplexArray
    port: ComplexArray
    bias: float
    engine: str
    ladder: Ladder | None
    checks: tuple[Difference, ...] = ()
    segment: int | None = None
    cells_error: float = 0.0

    @property
    def reflected(self) -> float:
        """The largest part of the impedance that the motion reflects onto the port."""
        return float((np.abs(self.impedance - self.port) / np.abs(self.port)).max())

    @property
    def least_resistance(self) -> float:
        """Smallest real part [ohm]; below zero the port, with its complex coupling N(s), is not passive."""
        return float(self.impedance.real.min())

    @property
    def warnings(self) -> list[str]:
        """Warnings on the spectrum as sentences."""
        if self.least_resistance < 0:
            return [
                f"the real part falls to {self.least_resistance:.3g} ohm: with this coupling the port is not passive"
            ]
        return []

    def table(self) -> tuple[Column, ...]:
        """Return frequency [Hz], real and imaginary part [ohm] (f,)."""
        parts = (Column("re", self.impedance.real, "ohm"), Column("im", self.impedance.imag, "ohm"))
        return (Column("frequency", self.frequency, "Hz", over=True), *parts)

    def to_dict(self) -> dict[str, Any]:
        """Return the spectrum as plain data, lists by header."""
        return {
            "actuator": self.actuator.name,
            "bias_V": self.bias,
            "engine": self.engine,
            **({"segment": self.segment, "cells_error": self.cells_error} if self.actuator.electrodes else {}),
            "spectrum": {header: plain(values) for header, values in self.columns().items()},
            "reflected": self.reflected,
            "least_resistance_ohm": self.least_resistance,
            "checks": [vars(difference) for difference in self.checks],
            "warnings": self.warnings,
        }


def frequencies(low: float, high: float, points: int | None = None) -> Array:
    """Return frequencies [Hz] from ``low`` to ``high``, evenly spaced in logarithm: ``points``, or ten per decade.

    Raises InputError for an invalid band, or fewer than 2 or more than 100000 points.
    """
    if not (np.isfinite([low, high]).all() and 0 < low < high):
        raise InputError(f"band {low:g} Hz to {high:g} Hz: give two frequencies above zero, the lower one first")
    if points is None:
        points = int(np.ceil(10 * np.log10(high / low))) + 1
    if not 2 <= points <= 100_000:
        raise InputError(f"{points} points: give 2 to 100000")
    return np.geomspace(low, high, points)


def impedance(
    actuator: Actuator,
    frequency: ArrayLike,
    *,
    bias: float = 0.0,
    tip: str = "free",
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "ngspice",
    segment: int | None = None,
) -> Impedance:
    """Return the impedance at ``frequency`` [Hz], ascending, for a small signal about ``bias`` [V].

    ``segment`` is one of a strip with electrodes, all others at 0 V; by default all are joined.

    ``tip``, ``beam`` and ``load`` as for `ilg_circuit.circuit.strip.strip_netlist`, ``engine`` ngspice or exact. Raises
    InputError for frequencies beyond the band of the actuator's ladder.
    """
    f = require_frequencies(actuator, frequency, bias, "an impedance")
    band = (float(f.min()) * 0.999, float(f.max()) * 1.001)
    port = lumped_elements(actuator, band).port
    line, own, cells_error = _line(actuator, band, segment, bias, f)
    netlist = strip_netlist(actuator, tip=tip, beam=beam, load=load, band=band, **line)
    found = spectrum(netlist, f, bias=bias, inner_bias=0.0 if line else port.inner_voltage(bias), engine=engine)
    return Impedance(
        actuator=actuator,
        frequency=f,
        impedance=1 / found.output("current"),
        port=port.impedance(2j * np.pi * f, bias) if own is None else own,
        bias=bias,
        engine=engine,
        ladder=port.ladder,
        segment=segment,
        cells_error=cells_error,
    )


def require_frequencies(
    actuator: Actuator, frequency: ArrayLike, bias: float, what: str = "a frequency response"
) -> Array:
    """Return the frequencies [Hz] (f,) of ``what``.

    Raises InputError unless they are positive and within the band of the strip's ladder, and ``bias`` [V] is finite.
    """
    f = np.asarray(frequency, dtype=float)
    if f.ndim != 1 or not len(f) or not (np.isfinite(f).all() and (f > 0).all()):
        raise InputError(f"{what} needs at least one frequency, all positive and finite")
    if not np.isfinite(bias):
        raise InputError(f"bias is {bias} V; give a finite voltage")
    _require_in_band(actuator, float(f.min()), float(f.max()))
    return f


def _line(
    actuator: Actuator, band: tuple[float, float], segment: int | None, bias: float, frequency: Array
) -> tuple[dict[str, Any], ComplexArray | None, float]:
    """Return what `line_of` gives, and between its parts the impedance (f,) of a line by its nodes, None for a lump."""
    sheets = actuator.electrodes
    wires = wiring(sheets, [str(segment)]) if sheets is not None and segment is not None else None
    if sheets is None and segment is not None:
        raise InputError(f"actuator '{actuator.name}' has no [electrodes], so no segments; leave segment out")
    if sheets is not None and bias and not lumped_elements(actuator, band).port.linear:
        raise InputError(
            f"a bias of {bias:g} V is not the same in all cells of a nonlinear strip with [electrodes]; leave it out"
        )
    line, error = line_of(actuator, band, wires)
    if sheets is None:
        return line, None, error
    wires = wires or joined(sheets)
    s: ComplexArray = np.asarray(2j * np.pi * frequency)
    found = line_response(actuator, line["layout"], wires, s, lumped_elements(actuator, band))
    return line, 1 / found.current[0], error


def _require_in_band(actuator: Actuator, low: float, high: float) -> None:
    m = actuator.material
    if not isinstance(m.model.ions, LadderPath):
        return
    lowest, highest = m.ladder_lowest or 0.0, m.ladder_highest or np.inf
    if low < lowest * (1 - 1e-9) or high > highest * (1 + 1e-9):
        asked, held = (
            " to ".join(format_quantity(x, "Hz", 4) if 0 < x < np.inf else "anywhere" for x in pair)
            for pair in ((low, high), (lowest, highest))
        )
        raise InputError(
            f"{asked} reaches beyond the ladder's band, {held}: ask for less, or change material.ladder_lowest and "
            "ladder_highest (if left out, the band follows the requested one)"
        )

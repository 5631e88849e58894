"""The impedance that a strip shows at its terminals, over frequency and about a bias voltage."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..circuit.strip import Load, strip_netlist
from ..errors import InputError
from ..files import write_text
from ..solve.spectrum import spectrum
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from ..strip.ladder import Ladder
from ..strip.models import LadderPath
from ..units import format_quantity

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True)
class Impedance:
    """``impedance`` [ohm] (f,) at ``frequency`` [Hz] (f,), small signal about ``bias`` [V].

    ``port`` [ohm] (f,) is the closed form of the electrical side alone, EC (1): what the motion reflects is the
    difference. ``ladder`` is what stands for a Warburg element or CPE, if there is one.
    """

    actuator: Actuator
    frequency: Array
    impedance: ComplexArray
    port: ComplexArray
    bias: float
    engine: str
    ladder: Ladder | None

    @property
    def reflected(self) -> float:
        """Largest part of the impedance that the motion reflects onto the port."""
        return float((np.abs(self.impedance - self.port) / np.abs(self.port)).max())

    @property
    def least_resistance(self) -> float:
        """Smallest real part [ohm]; below zero the port, with its complex coupling N(s), is not passive."""
        return float(self.impedance.real.min())

    def write_csv(self, path: str | Path) -> None:
        """Columns frequency_Hz, re_ohm, im_ohm with full precision."""
        rows = ["frequency_Hz,re_ohm,im_ohm"]
        table = zip(self.frequency.tolist(), self.impedance.real.tolist(), self.impedance.imag.tolist(), strict=True)
        rows += [f"{f!r},{re!r},{im!r}" for f, re, im in table]
        write_text(Path(path), "\n".join(rows) + "\n")

    def summary(self) -> str:
        """A few lines: both ends of the spectrum, and what stands behind it."""
        lines = []
        for k in (0, -1):
            z = self.impedance[k]
            lines.append(
                f"{format_quantity(float(self.frequency[k]), 'Hz', 4):>10}  abs(Z) "
                f"{format_quantity(float(np.abs(z)), 'ohm', 5):>12}, phase {np.degrees(np.angle(z)):7.2f} deg"
            )
        lines.append(f"the motion reflects at most {self.reflected:.1e} of the impedance")
        if self.ladder is not None:
            low, high = (format_quantity(f, "Hz", 4) for f in self.ladder.band)
            name = self.ladder.ions.title
            lines.append(
                f"{name} as a ladder of {len(self.ladder.sections)} sections, within {self.ladder.error:.1e} of it "
                f"from {low} to {high}"
            )
        return "\n".join(lines)

    def warnings(self) -> list[str]:
        if self.least_resistance < 0:
            return [
                f"the real part falls to {self.least_resistance:.3g} ohm: with this coupling the port is not passive"
            ]
        return []


def frequencies(low: float, high: float, points: int | None = None) -> Array:
    """Frequencies [Hz] even in logarithm from ``low`` to ``high``: ``points`` of them, or ten a decade."""
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
    beam: str = "dynamic",
    load: Load | None = None,
    engine: str = "ngspice",
) -> Impedance:
    """Impedance at ``frequency`` [Hz], ascending, small signal about ``bias`` [V]; the rest as for `strip_netlist`.

    Raises InputError for frequencies beyond the band that the actuator gives its ladder.
    """
    f = np.asarray(frequency, dtype=float)
    if f.ndim != 1 or not len(f) or not (np.isfinite(f).all() and (f > 0).all()):
        raise InputError("an impedance needs at least one frequency, all positive and finite")
    if not np.isfinite(bias):
        raise InputError(f"bias is {bias} V; give a finite voltage")
    low, high = float(f.min()), float(f.max())
    band = (low * 0.999, high * 1.001)
    _require_in_band(actuator, low, high)
    port = lumped_elements(actuator, band).port
    netlist = strip_netlist(actuator, tip=tip, beam=beam, load=load, band=band)
    found = spectrum(netlist, f, bias=bias, inner_bias=port.inner_voltage(bias), engine=engine)
    return Impedance(
        actuator=actuator,
        frequency=f,
        impedance=1 / found.output("current"),
        port=port.impedance(2j * np.pi * f, bias),
        bias=bias,
        engine=engine,
        ladder=port.ladder,
    )


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
            "ladder_highest (leave them out, and the band follows the question)"
        )

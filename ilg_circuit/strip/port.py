"""The strip's electrical port as lumped values: electrodes, electron path, ion path. EC (1)-(5) and its extensions.

    drive -- L -- Re --+-- electron path: Rdc, or i = Is sinh(v/Vt) with Rdc = Vt/Is at 0 V
                       +-- ion path: R-C branches in parallel, or a resistor in series with a ladder

The charge on the branches' capacitances may follow another law than q = C v: see `ilg_circuit.strip.charge_laws`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, ComplexArray
from ..errors import InputError, SolveError
from .charge_laws import ChargeLaw, GrowingLaw, SaturatingLaw, StericLaw, require_rising
from .ladder import Ladder


def hyperbolic_cosine(x: float) -> float:
    """Return cosh(x). Raises SolveError where it overflows, as it does in ngspice."""
    try:
        return math.cosh(x)
    except OverflowError:
        raise SolveError(
            f"the electron path's sinh law has no finite current at {abs(x):.3g} times its emission voltage; lower the "
            "voltage or raise the emission voltage"
        ) from None


@dataclass(frozen=True)
class Port:
    """Lumped values of one strip's electrical side.

    ``dc_resistance`` Rdc [ohm] of the electron path near 0 V; for the ions ``branches`` ((R [ohm], C [F]), ...), or a
    ``ladder`` behind ``series_resistance`` [ohm]; ``electrode_resistance`` Re [ohm]; ``emission_voltage`` Vt [V] of a
    sinh electron path, None for an ohmic one; ``inductance`` L [H] of the leads. At most one law of charge:
    ``capacitance_slope`` [1/V], relative to C; ``saturation_voltage`` [V]; ``packing_fraction``.
    """

    dc_resistance: float
    branches: tuple[tuple[float, float], ...] = ()
    electrode_resistance: float = 0.0
    ladder: Ladder | None = None
    series_resistance: float = 0.0
    emission_voltage: float | None = None
    capacitance_slope: float = 0.0
    inductance: float = 0.0
    saturation_voltage: float | None = None
    packing_fraction: float | None = None

    def __post_init__(self) -> None:
        if bool(self.branches) == (self.ladder is not None):
            raise InputError("an ion path is either R-C branches or one ladder")
        if self.charge_law is not None and self.ladder is not None:
            raise InputError("a charge that is not linear in the voltage goes with R-C branches, not with a ladder")

    @property
    def charge_law(self) -> ChargeLaw | None:
        """The law of the charge on the branches' capacitances; None for q = C v."""
        if self.capacitance_slope:
            return GrowingLaw(self.capacitance_slope)
        if self.saturation_voltage is not None:
            return SaturatingLaw(self.saturation_voltage)
        return None if self.packing_fraction is None else StericLaw(self.packing_fraction)

    def share(self, fraction: float) -> Port:
        """Return the port of this fraction of the strip's area, without what leads to it: Re and the inductance."""
        ladder = self.ladder
        if ladder is not None:
            sections = tuple((r / fraction, c * fraction) for r, c in ladder.sections)
            whole = ladder.resistance / fraction, ladder.capacitance * fraction
            ladder = replace(ladder, resistance=whole[0], capacitance=whole[1], sections=sections)
        return replace(
            self,
            dc_resistance=self.dc_resistance / fraction,
            branches=tuple((r / fraction, c * fraction) for r, c in self.branches),
            electrode_resistance=0.0,
            ladder=ladder,
            series_resistance=self.series_resistance / fraction,
            inductance=0.0,
        )

    @property
    def linear(self) -> bool:
        return self.emission_voltage is None and self.charge_law is None

    @property
    def capacitance(self) -> float:
        """What the ion path stores at rest per volt near 0 V [F]."""
        return self.ladder.capacitance if self.ladder is not None else sum(c for _, c in self.branches)

    @property
    def dynamic_resistance(self) -> float:
        """Rd [ohm] of the first ionic branch, or the resistance before a ladder."""
        return self.branches[0][0] if self.branches else self.series_resistance

    @property
    def steady_resistance(self) -> float:
        """Resistance [ohm] of the port near 0 V once the ions are at rest: Re + Rdc."""
        return self.electrode_resistance + self.dc_resistance

    @property
    def high_frequency_resistance(self) -> float:
        """Resistance [ohm] of the port near 0 V as the frequency goes to infinity, its inductance apart."""
        ions = self.series_resistance if self.ladder is not None else 1 / sum(1 / r for r, _ in self.branches)
        return self.electrode_resistance + 1 / (1 / self.dc_resistance + 1 / ions)

    @property
    def saturation_current(self) -> float:
        """Is = Vt/Rdc [A] of a sinh electron path; infinite for an ohmic one."""
        return math.inf if self.emission_voltage is None else self.emission_voltage / self.dc_resistance

    def electron_current(self, voltage: ArrayLike) -> Array:
        """Return the current [A] through the electron path at ``voltage`` [V] across it."""
        v = np.asarray(voltage, dtype=float)
        if self.emission_voltage is None:
            return v / self.dc_resistance
        return np.asarray(self.saturation_current * np.sinh(v / self.emission_voltage))

    def charge(self, voltage: float) -> float:
        """Return the charge [C] of the ion path at rest under ``voltage`` [V] across it."""
        law = self.charge_law
        return self.capacitance * (voltage if law is None else float(law.charge(voltage)))

    def inner_voltage(self, terminal: float) -> float:
        """Return the voltage [V] behind Re once the ions are at rest under ``terminal`` [V]."""
        return self.voltage_behind(1 / self.electrode_resistance, terminal) if self.electrode_resistance else terminal

    def voltage_behind(self, conductance: float, source: float) -> float:
        """Return the voltage [V] across the electron path alone, behind a ``conductance`` [S] from a ``source`` [V]."""
        if self.emission_voltage is None:
            return source * conductance / (conductance + 1 / self.dc_resistance)
        from scipy.optimize import brentq

        size = abs(source)
        if not size:
            return 0.0
        # sinh runs away: no more than the voltage at which it alone would take the whole current
        most = min(size, self.emission_voltage * math.asinh(size * conductance / self.saturation_current))
        most *= 1 + 1e-9  # beyond the root whatever the last digits do
        root = brentq(lambda v: v - size + float(self.electron_current(v)) / conductance, 0.0, most, xtol=1e-15)
        return math.copysign(float(root), source)

    def linearised(self, inner_voltage: float = 0.0) -> Port:
        """Return the port that a small signal meets, at rest under ``inner_voltage`` [V] behind Re."""
        dc = self.dc_resistance
        if self.emission_voltage is not None:
            dc /= hyperbolic_cosine(inner_voltage / self.emission_voltage)
        law = self.charge_law
        if law is not None:
            require_rising(law, inner_voltage)
        growth = 1.0 if law is None else float(law.slope(inner_voltage))
        branches = tuple((r, c * growth) for r, c in self.branches)
        linear = replace(self, dc_resistance=dc, branches=branches, emission_voltage=None, capacitance_slope=0.0)
        return replace(linear, saturation_voltage=None, packing_fraction=None)

    def ion_impedance(self, s: ArrayLike, *, ideal: bool = False) -> ComplexArray:
        """Return Zp(s) [ohm] of the ion path near 0 V; ``ideal``: of the element in place of its ladder."""
        points = np.asarray(s, dtype=complex)
        if self.ladder is not None:
            diffusion = self.ladder.ideal(points) if ideal else self.ladder.impedance(points)
            return np.asarray(self.series_resistance + diffusion)
        return np.asarray(1 / sum(c * points / (1 + r * c * points) for r, c in self.branches))

    def ion_elastance(self, s: ArrayLike) -> ComplexArray:
        """Return s Zp(s) [1/F], written without the pole of Zp at s = 0."""
        points = np.asarray(s, dtype=complex)
        if self.ladder is None:
            return np.asarray(1 / sum(c / (1 + r * c * points) for r, c in self.branches))
        relaxing = sum(r / (1 + r * c * points) for r, c in self.ladder.sections)
        return np.asarray(
            points * (self.series_resistance + self.ladder.resistance + relaxing) + 1 / self.ladder.capacitance
        )

    def impedance(self, s: ArrayLike, bias: float = 0.0, *, ideal: bool = False) -> ComplexArray:
        """Return Z(s) [ohm] at the terminals for a small signal about ``bias`` [V], EC (1): L s + Re + Rdc || Zp."""
        points = np.asarray(s, dtype=complex)
        small = self.linearised(self.inner_voltage(bias))
        ion = small.ion_impedance(points, ideal=ideal)
        parallel = 1 / (1 / small.dc_resistance + 1 / ion)
        return np.asarray(self.inductance * points + self.electrode_resistance + parallel)

"""Computes the frequency response of a strip: displacement, current and blocked force for a small voltage."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, ComplexArray, plain
from ..circuit.load import Load
from ..circuit.strip import strip_netlist
from ..errors import InputError, argument
from ..result import Column, Result
from ..solve.spectrum import spectrum
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements
from .impedance import require_frequencies
from .prediction_band import scaled

#: Quantities with their units, the tip that each is taken at, and the output of the netlist.
QUANTITIES = {"displacement": ("m/V", "free"), "current": ("A/V", "free"), "force": ("N/V", "clamped")}
#: Step of the central differences of a band, in parts of a parameter.
_STEP = 1e-4
_HALF_POWER = 1 / np.sqrt(2)


@dataclass(frozen=True, repr=False, eq=False)
class Bode(Result):
    """The frequency response of a strip for a small signal, as `ilg_circuit.bode` returns it.

    Attributes
    ----------
    frequency : ndarray (f,)
        Frequencies [Hz].
    displacement : ndarray (f,), complex
        Displacement at L_F of the free tip, or under the load, per volt [m/V].
    current : ndarray (f,), complex
        Current per volt [A/V].
    force : ndarray (f,), complex
        Force on a clamp that holds L_F, per volt [N/V].
    bias : float
        Voltage about which the signal is small [V].
    stderr : dict of str to ndarray (f,), complex
        For each quantity, the standard errors of the logarithm of its magnitude (real part) and of its phase in radians
        (imaginary part), from the strip's covariance; empty without ``band=True``.
    actuator : Actuator
        The strip.
    engine : str
        Name of the solver.
    """

    presenter: ClassVar[str] = "bode"
    actuator: Actuator
    frequency: Array
    displacement: ComplexArray
    current: ComplexArray
    force: ComplexArray
    bias: float
    engine: str
    stderr: dict[str, ComplexArray] = field(default_factory=dict)

    def at(self, places: NDArray[np.intp]) -> Bode:
        """Return the response at ``places`` of the frequencies, in their order."""
        return replace(
            self,
            frequency=self.frequency[places],
            displacement=self.displacement[places],
            current=self.current[places],
            force=self.force[places],
            stderr={name: error[places] for name, error in self.stderr.items()},
        )

    def response(self, name: str) -> ComplexArray:
        """Return the response (f,) of "displacement", "current" or "force"."""
        found: ComplexArray = getattr(self, name)
        return found

    def magnitude(self, name: str) -> Array:
        """Return the magnitude (f,) of a response."""
        return np.abs(self.response(name))

    def phase(self, name: str) -> Array:
        """Return the phase (f,) of a response [deg], without jumps of a whole turn."""
        return np.degrees(np.unwrap(np.angle(self.response(name))))

    @property
    def bandwidth(self) -> float | None:
        """Frequency [Hz] from which on the displacement is below 0.707 of that at the lowest one; None if never."""
        return half_power(self.frequency, self.magnitude("displacement"))

    @property
    def peak(self) -> tuple[float, float]:
        """Frequency [Hz] at which the displacement per volt is largest, and its size there [m/V]."""
        size = self.magnitude("displacement")
        k = int(np.argmax(size))
        return float(self.frequency[k]), float(size[k])

    @property
    def warnings(self) -> list[str]:
        """Warnings as sentences."""
        return []

    def table(self) -> tuple[Column, ...]:
        """Return frequency [Hz], magnitudes and phases [deg] (f,); with a band their standard errors, too."""
        columns = [Column("frequency", self.frequency, "Hz", over=True)]
        for name, (unit, _) in QUANTITIES.items():
            columns += [Column(name, self.magnitude(name), unit), Column(f"{name}_phase", self.phase(name), "deg")]
            if name in self.stderr:
                error = self.stderr[name]
                columns += [
                    Column(f"{name}_stderr", self.magnitude(name) * error.real, unit),
                    Column(f"{name}_phase_stderr", np.degrees(error.imag), "deg"),
                ]
        return tuple(columns)

    def to_dict(self) -> dict[str, Any]:
        """Return the response as plain data, lists by header."""
        return {
            "actuator": self.actuator.name,
            "bias_V": self.bias,
            "engine": self.engine,
            "bode": {header: plain(values) for header, values in self.columns().items()},
            "bandwidth_Hz": self.bandwidth,
            "peak_Hz": self.peak[0],
            "peak_m_per_V": self.peak[1],
            "warnings": self.warnings,
        }


def half_power(frequency: Array, size: Array) -> float | None:
    """Return the frequency [Hz] from which on a ``size`` (f,) is below 0.707 of the first; None if it never is."""
    limit = _HALF_POWER * size[0]
    above = np.flatnonzero(size >= limit)
    if not len(above) or above[-1] == len(size) - 1:
        return None
    k = int(above[-1])
    x, y = np.log(frequency[k : k + 2]), np.log(size[k : k + 2])
    return float(np.exp(x[0] + (np.log(limit) - y[0]) / (y[1] - y[0]) * (x[1] - x[0])))


def bode(
    actuator: Actuator,
    frequency: ArrayLike,
    *,
    bias: float = 0.0,
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "exact",
    band: bool = False,
) -> Bode:
    """Return the frequency response at ``frequency`` [Hz], ascending, for a small signal about ``bias`` [V].

    ``beam`` and ``load`` as for `ilg_circuit.circuit.strip.strip_netlist`, ``engine`` ngspice or exact; with ``band``
    the standard errors that follow from the strip's covariance. Raises InputError for a strip without coupling, one
    without covariance where a band is asked for, or frequencies beyond the band of its ladder.
    """
    if actuator.coupling is None:
        raise InputError(
            f"actuator '{actuator.name}' has no [coupling], so its motion has no response; "
            "fit a displacement, or ask for its impedance"
        )
    f = require_frequencies(actuator, frequency, bias)
    found = _responses(actuator, f, bias, beam, load, engine)
    errors = _errors(actuator, f, bias, beam, load, found) if band else {}
    return Bode(
        actuator=actuator,
        frequency=f,
        displacement=found["displacement"],
        current=found["current"],
        force=found["force"],
        bias=bias,
        engine=engine,
        stderr=errors,
    )


def _responses(
    actuator: Actuator, f: Array, bias: float, beam: str | None, load: Load | None, engine: str
) -> dict[str, ComplexArray]:
    """Return the response of every quantity."""
    ladder = float(f.min()) * 0.999, float(f.max()) * 1.001
    inner = lumped_elements(actuator, ladder).port.inner_voltage(bias)
    found: dict[str, ComplexArray] = {}
    for tip in ("free", "clamped"):
        held = tip == "clamped"
        netlist = strip_netlist(actuator, tip=tip, beam=beam, load=None if held else load, band=ladder)
        solved = spectrum(netlist, f, bias=bias, inner_bias=inner, engine=engine)
        found |= {name: solved.output(name) for name, (_, at) in QUANTITIES.items() if at == tip}
    return found


def _errors(
    actuator: Actuator, f: Array, bias: float, beam: str | None, load: Load | None, found: dict[str, ComplexArray]
) -> dict[str, ComplexArray]:
    """Return standard errors of logarithm and phase: the covariance carried through, to first order."""
    uncertainty = actuator.uncertainty
    if uncertainty is None:
        raise InputError(
            f"actuator '{actuator.name}' has no [uncertainty]: fit one with identify, or leave {argument('band')} out"
        )
    ladder = float(f.min()) * 0.999, float(f.max()) * 1.001
    slopes: dict[str, list[ComplexArray]] = {name: [] for name in found}
    for parameter in uncertainty.names:
        up, down = (
            _responses(scaled(actuator, {parameter: float(np.exp(k * _STEP))}, ladder), f, bias, beam, load, "exact")
            for k in (1.0, -1.0)
        )
        for name in found:
            slopes[name].append(np.asarray(np.log(up[name] / down[name]) / (2 * _STEP)))
    covariance = np.array(uncertainty.covariance)
    errors = {}
    for name, rows in slopes.items():
        parts = [np.array(rows).real, np.array(rows).imag]
        size, phase = (np.sqrt(np.maximum(np.einsum("pf,pq,qf->f", s, covariance, s), 0.0)) for s in parts)
        errors[name] = np.asarray(size + 1j * phase)
    return errors

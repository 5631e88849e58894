"""What is measured of one strip's terminals, in one form for a joint fit: currents over time, and impedance spectra.

Whatever the kind, a data set has a fit of its own by any electrical model, and takes part in a fit of several as a
`Part`. Currents come from the transient of the netlist, spectra from the port's closed form; both take the same
parameters, at large signal and at small signal about a bias.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import IlgError, InputError, SolveError
from ..fit.least_squares import Fit
from ..fit.residuals import effective_samples, independent_samples, structured
from ..fit.together import Part
from ..measurements.prepare import Measurement
from ..measurements.spectrum_files import Spectrum
from ..simulation.response import transient_band
from ..strip.models import ElectricalModel, Ladders
from ..strip.port import Port
from .current import currents, fit_current, ladders_for
from .identification import require_electrode_resistance
from .kramers_kronig import KramersKronig, kramers_kronig
from .selection import scouting_engine
from .spectrum_fit import fit_spectrum

Array = NDArray[np.float64]
Progress = Callable[[], None] | None

#: Own fits fall back to this model where the data set alone does not hold the one asked for.
_SIMPLEST = "rc"
#: A data set counts as if it had noise of this part of its size at least: simulated ones may have none.
_LEAST_SIGMA = 1e-9
#: So many samples before the onset tell the instrument's offset.
_REST = 5
#: A closed form takes a ladder's constants from the port, however many sections it has.
ANY_LADDER = Ladders(sections=1)


@dataclass(frozen=True)
class PortModel:
    """An electrical model and its Re [ohm]: ``held``, or one more parameter where that is None.

    ``typical`` are values of the model's parameters by which ladders are designed.
    """

    kind: ElectricalModel
    held: float | None
    typical: tuple[float, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.kind.names, "electrode_resistance") if self.held is None else self.kind.names

    @property
    def below(self) -> Array:
        """Limits of the parameters."""
        limits = [p.upper for p in self.kind.parameters]
        return np.array([*limits, np.inf] if self.held is None else limits)

    @property
    def units(self) -> dict[str, str]:
        return {p.name: p.unit for p in self.kind.parameters} | {"electrode_resistance": "ohm"}

    def port(self, values: Array, ladders: Ladders | None = None) -> Port:
        """The port that ``values`` (n,), in the order of ``names``, make."""
        electrode = float(values[-1]) if self.held is None else self.held
        return self.kind.port(values[: len(self.kind.names)].tolist(), electrode, ladders)


@dataclass(frozen=True)
class OwnFit:
    """A data set's fit by itself. ``model``: what it holds alone; ``fitted`` (samples,) in the data set's numbers.

    ``independent`` is the number of samples that its residuals amount to.
    """

    model: str
    fit: Fit
    fitted: Array
    rms: float
    independent: float
    warnings: tuple[str, ...]

    @property
    def sure(self) -> bool:
        """Whether every parameter is known at least in its order of magnitude."""
        return bool((self.fit.errors < self.fit.values).all())

    @property
    def values(self) -> dict[str, float]:
        return dict(zip(self.fit.names, self.fit.values.tolist(), strict=True))


class Dataset(Protocol):
    """One file's currents or impedances. ``data`` (samples,) are real numbers of the unit ``unit``.

    ``size`` is what misfits are compared with; ``voltage`` [V] the largest applied, or the bias, and ``level`` that of
    all the time, None for a waveform; ``notes`` what was told when the file was read.
    """

    @property
    def source(self) -> str: ...
    @property
    def quantity(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def voltage(self) -> float: ...
    @property
    def level(self) -> float | None: ...
    @property
    def abscissa(self) -> Array: ...
    @property
    def data(self) -> Array: ...
    @property
    def size(self) -> float: ...
    @property
    def band(self) -> tuple[float, float]: ...
    @property
    def notes(self) -> tuple[str, ...]: ...

    def shown(self, numbers: Array) -> NDArray[Any]:
        """``numbers`` as they were measured [A] or [ohm], one a point of ``abscissa``."""

    def own(self, kind: ElectricalModel, held: float, progress: Progress) -> OwnFit:
        """The fit of this data set alone."""

    def part(self, model: PortModel, sigma: float) -> Part:
        """This data set in a joint fit."""

    def independent(self, residuals: Array) -> float:
        """Number of independent samples that its residuals amount to."""


@dataclass(frozen=True)
class CurrentData:
    """The current of a record over time since the onset [s]."""

    measurement: Measurement
    engine: str
    source: str

    quantity = "current"
    unit = "A"

    @property
    def voltage(self) -> float:
        drive = self.measurement.drive
        return self.measurement.step or float(drive.values[np.argmax(np.abs(drive.values))])

    @property
    def level(self) -> float | None:
        return self.measurement.step

    @property
    def notes(self) -> tuple[str, ...]:
        return self.measurement.notes

    @property
    def offset(self) -> bool:
        """Whether its rest tells the instrument's offset, which is then fitted, however small: small ones matter too
        where several voltages are compared."""
        return int(self.measurement.current.rest.sum()) >= _REST

    @property
    def _kept(self) -> NDArray[np.bool_]:
        rest = self.measurement.current.rest
        return np.ones(len(rest), dtype=bool) if self.offset else ~rest

    @property
    def abscissa(self) -> Array:
        return self.measurement.current.time[self._kept]

    @property
    def data(self) -> Array:
        return self.measurement.current.values[self._kept]

    @property
    def size(self) -> float:
        return float(np.abs(self.data).max())

    @property
    def band(self) -> tuple[float, float]:
        return transient_band(self.abscissa[self.abscissa >= 0])

    def shown(self, numbers: Array) -> NDArray[Any]:
        return numbers

    def own(self, kind: ElectricalModel, held: float, progress: Progress) -> OwnFit:
        require_electrode_resistance(held, self.measurement)

        def fit(model: str) -> OwnFit:
            engine = scouting_engine(self.measurement, model, self.engine)
            found = fit_current(self.measurement, held, model, engine, progress)
            fitted = np.zeros(len(self.abscissa))  # as at rest, where the own fit has no offset
            fitted[len(fitted) - len(found.data) :] = found.fitted
            independent = self.independent(found.fit.residuals)
            return OwnFit(model, found.fit, fitted, found.fit.rmse, independent, found.warnings)

        # one step does not tell a sinh electron path from a resistor
        models = [] if "emission_voltage" in kind.names and self.measurement.step is not None else [kind.name]
        return _first_that_fits(self.source, [*models, kind.name.split("+")[0]], fit)

    def part(self, model: PortModel, sigma: float) -> Part:
        ladders = ladders_for(model.kind, np.array(model.typical), self.abscissa[self.abscissa >= 0])
        t = self.abscissa

        def modelled(values: Array) -> Array:
            return currents([model.port(v, ladders) for v in values], self.measurement.drive, t, self.engine)

        nuisance = np.ones((len(t), int(self.offset)))
        return Part(self.source, self.data, nuisance, modelled, sigma)

    def independent(self, residuals: Array) -> float:
        return independent_samples(residuals)


@dataclass(frozen=True)
class SpectrumData:
    """An impedance over frequency [Hz], small signal about ``bias`` [V]; its numbers are Re Z and Im Z over abs(Z).

    Points that break the Kramers-Kronig relations are left out.
    """

    spectrum: Spectrum
    check: KramersKronig
    bias: float
    source: str

    quantity = "impedance"
    unit = ""
    size = 1.0

    @classmethod
    def of(cls, spectrum: Spectrum, bias: float, source: str) -> SpectrumData:
        check = kramers_kronig(spectrum)
        return cls(spectrum.without(check.bad), check, bias, source)

    @property
    def voltage(self) -> float:
        return self.bias

    @property
    def level(self) -> float | None:
        return self.bias

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.spectrum.notes, *self.check.warnings)

    @property
    def abscissa(self) -> Array:
        return self.spectrum.frequency

    @property
    def data(self) -> Array:
        return np.asarray(self._numbers(self.spectrum.impedance[None])[0])

    @property
    def band(self) -> tuple[float, float]:
        f = self.spectrum.frequency
        return float(f[0]) * 0.999, float(f[-1]) * 1.001

    def _numbers(self, impedance: NDArray[np.complex128]) -> Array:
        relative = impedance / self.spectrum.modulus
        return np.asarray(np.concatenate([relative.real, relative.imag], axis=1))

    def shown(self, numbers: Array) -> NDArray[Any]:
        real, imaginary = np.split(numbers, 2)
        return np.asarray((real + 1j * imaginary) * self.spectrum.modulus)

    def own(self, kind: ElectricalModel, held: float, progress: Progress) -> OwnFit:
        def fit(model: str) -> OwnFit:
            found = fit_spectrum(self.spectrum, model, held, progress=progress)
            fitted = self._numbers(found.fitted[None])[0]
            return OwnFit(model, found.fit, fitted, found.relative_rms, self.independent(self.data - fitted), ())

        return _first_that_fits(self.source, [kind.name.split("+")[0]], fit)

    def part(self, model: PortModel, sigma: float) -> Part:
        s: NDArray[np.complex128] = np.asarray(2j * np.pi * self.spectrum.frequency)

        def modelled(values: Array) -> Array:
            ports = [model.port(v, ANY_LADDER) for v in values]
            z = [port.impedance(s, self.bias, ideal=True) for port in ports]
            return self._numbers(np.asarray(z, dtype=complex))

        return Part(self.source, self.data, np.zeros((len(self.data), 0)), modelled, sigma)

    def independent(self, residuals: Array) -> float:
        parts = np.split(residuals, 2)
        if not any(structured(part) for part in parts):
            return float(len(residuals))
        return max(sum(effective_samples(part) for part in parts), 5.0)


def sigma_of(data: Dataset, own: OwnFit) -> float:
    """The unit in which a data set's misfits count: what its own fit leaves, as far as samples are independent."""
    samples = len(own.fit.residuals)
    spent = np.sqrt(samples / max(samples - own.fit.count, 1))
    alike = np.sqrt(samples / own.independent)
    return max(float(own.rms * spent * alike), _LEAST_SIGMA * data.size)


def _first_that_fits(source: str, models: list[str], fit: Callable[[str], OwnFit]) -> OwnFit:
    """The first of ``models`` that the data set by itself can be fitted with, the simplest one failing all."""
    for model in dict.fromkeys(models):
        with suppress(InputError, SolveError):
            return fit(model)
    try:
        return fit(_SIMPLEST)
    except IlgError as error:
        told = str(error)
        raise type(error)(told if told.startswith(f"{source}: ") else f"{source}: {told}") from None


def labelled(sources: list[str]) -> list[str]:
    """File names, told apart where folders hold files of the same name."""
    return [s if sources.count(s) == 1 else f"{s} ({sources[: k + 1].count(s)})" for k, s in enumerate(sources)]


def dataset_of(record: Measurement | Spectrum, engine: str, bias: float, source: str) -> Dataset:
    """The data set that a record or a spectrum holds."""
    if isinstance(record, Spectrum):
        return SpectrumData.of(replace(record, source=source), bias, source)
    return CurrentData(record, engine, source)

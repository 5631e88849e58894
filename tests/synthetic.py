"""Records and spectra as an instrument would make them: simulated, with rest, noise, offsets and drift; their fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.identification.current import CurrentData
from ilg_circuit.identification.port_fit import PortFit, fit_port
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Coupling, IonBranch
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]

UNITS = {"time": "s", "voltage": "V", "current": "A", "displacement": "m"}


def ready(table: Table) -> Record:
    """The record of a table whose samples at jumps are right limits, so that its onset is at the first of them."""
    return prepare(table, "first-level")


@dataclass(frozen=True)
class Synthetic:
    """Columns [SI] of a measurement and the strip that was measured."""

    columns: dict[str, Array]
    strip: Actuator

    def table(self) -> Table:
        return Table(self.columns, "record.csv")

    def measurement(self, source: str = "record.csv") -> Record:
        return replace(ready(self.table()), source=source)

    def changed(self, **columns: Array | None) -> Synthetic:
        """With some columns replaced, or left out where None is given."""
        merged = {**self.columns, **columns}
        return replace(self, columns={k: v for k, v in merged.items() if v is not None})

    def rows(self, chosen: slice | NDArray[np.bool_] | NDArray[np.intp]) -> Synthetic:
        return replace(self, columns={k: v[chosen] for k, v in self.columns.items()})

    def write(self, path: Path, units: dict[str, tuple[str, float]] | None = None) -> Path:
        """As a CSV file; ``units``: (unit, factor from SI) of a column, the SI unit where none is given."""
        chosen = {name: (units or {}).get(name, (UNITS[name], 1.0)) for name in self.columns}
        rows = [",".join(f"{name}_{unit}" for name, (unit, _) in chosen.items())]
        table = np.column_stack([self.columns[name] * factor for name, (_, factor) in chosen.items()])
        rows += [",".join("" if x != x else f"{x:.12g}" for x in row) for row in table.tolist()]
        path.write_text("\n".join(rows) + "\n")
        return path


def record(
    drive: Drive,
    duration: float,
    samples: int = 201,
    *,
    strip: Actuator = PAPER,
    beam: str = "static",
    rest: int = 0,
    displacement: bool = False,
    seed: int = 0,
    noise: float = 0.0,
    voltage_noise: float = 0.0,
    rest_position: float = 0.0,
    drift: float = 0.0,
    axis: float = 1.0,
    current_offset: float = 0.0,
    start: float = 0.0,
) -> Synthetic:
    """A record of ``samples`` over ``duration`` [s] after ``rest`` samples of zero volts; its first time is ``start``.

    ``noise`` is relative to each waveform's largest value, ``voltage_noise`` [V]; ``drift`` [m/s]; ``axis`` -1 is a
    camera that looks from the other side.
    """
    random = np.random.default_rng(seed)
    after = np.linspace(0.0, duration, samples)
    step = after[1]
    response = simulate(
        strip, drive, after, beam=beam, engine="exact" if lumped_elements(strip).port.linear else "ngspice"
    )
    time = np.concatenate([-step * np.arange(rest, 0, -1), after])

    def noisy(values: Array, size: float) -> Array:
        return np.concatenate([np.zeros(rest), values]) + size * random.standard_normal(len(time))

    columns = {
        "time": time + rest * step + start,
        "voltage": noisy(response.voltage, voltage_noise),
        "current": noisy(response.current, noise * float(np.abs(response.current).max())) + current_offset,
    }
    if displacement:
        moved = noisy(response.displacement, noise * float(np.abs(response.displacement).max()))
        columns["displacement"] = axis * moved + rest_position + drift * time
    return Synthetic(columns, strip)


def step(voltage: float = 4.0) -> PiecewiseLinear:
    return PiecewiseLinear.step(voltage)


def drives(voltage: float, scale: float = 1.0) -> dict[str, Drive]:
    """The waveforms of a laboratory for a strip whose time constants are the paper's times ``scale``."""
    return {
        "step": step(voltage),
        "square": PiecewiseLinear.square(0.0, voltage, 60.0 * scale, 300.0 * scale),
        "sine": Sine(voltage, 0.01 / scale),
        "ramp": PiecewiseLinear.ramp(voltage / 300.0 / scale, 300.0 * scale),
    }


def scaled(time: float = 1.0, size: float = 1.0) -> Actuator:
    """The paper's strip with every time constant times ``time`` and every conductance times ``size``."""
    m, k = PAPER.material, PAPER.coupling
    assert k is not None
    material = replace(
        m,
        dc_resistivity=m.dc_resistivity / size,
        dynamic_resistivity=m.dynamic_resistivity / size,
        permittivity=m.permittivity * size * time,
    )
    coupling = Coupling(k.gain / time, k.zero / time, k.damping_ratio, k.natural_frequency / time)
    return replace(PAPER, material=material, coupling=coupling)


def two_branches() -> Actuator:
    """The paper's strip with a second, slower branch: 171.4 ohm and 0.14 F, 24 s."""
    return replace(PAPER, material=replace(PAPER.material, further_branches=(IonBranch(60.0, 0.4),)))


def spectrum(
    strip: Actuator,
    low: float,
    high: float,
    points: int = 40,
    *,
    noise: float = 3e-3,
    bias: float = 0.0,
    seed: int = 0,
    source: str = "z.csv",
) -> Spectrum:
    """The port's closed form from ``low`` to ``high`` [Hz] about ``bias`` [V], with ``noise`` in each part."""
    f = np.geomspace(low, high, points)
    z = lumped_elements(strip, (low / 2, 2 * high)).port.impedance(2j * np.pi * f, bias, ideal=True)
    return Spectrum(source, f, z * noisy_factor(points, noise, seed))


def noisy_factor(points: int, noise: float, seed: int) -> NDArray[np.complex128]:
    """1 + noise of a spectrum's real and imaginary parts, relative to abs(Z)."""
    random = np.random.default_rng(seed)
    return 1 + noise * (random.standard_normal(points) + 1j * random.standard_normal(points))


def write_spectrum(z: Spectrum, path: Path) -> Path:
    rows = zip(z.frequency.tolist(), z.impedance.real.tolist(), z.impedance.imag.tolist(), strict=True)
    path.write_text("frequency_Hz,re_ohm,im_ohm\n" + "\n".join(f"{f!r},{re!r},{im!r}" for f, re, im in rows) + "\n")
    return path


def current_data(r: Synthetic | Record, engine: str = "ngspice") -> CurrentData:
    """The current of a record as an observation of the port."""
    m = r if isinstance(r, Record) else r.measurement()
    return CurrentData(m, engine, m.source)


def fit_current(r: Synthetic | Record, model: str = "rc", held: float = 0.0, engine: str = "ngspice") -> PortFit:
    """The port from one record's current, by a model asked for."""
    return fit_port((current_data(r, engine),), model, held)

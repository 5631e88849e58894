"""Do the 95 % intervals of fits hold the truth 95 times in a hundred? Noisy data of known strips tell.

python benchmarks/intervals.py [data sets a model, default 1000] [models to do, default all]     writes INTERVALS.md

Spectra are fitted by their closed form, steps and waveforms with the exact engine, in whose place ngspice gives the
same fit (the tests say so), each from all its starts. Steps under autocorrelated noise, AR(1), are fitted by the closed
form from the truth, and their intervals are those that are reported.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from figure import Figure
from numpy.typing import NDArray
from tqdm import tqdm

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import SolveError
from ilg_circuit.fit.fitting import fit
from ilg_circuit.fit.intervals import uncertainties
from ilg_circuit.identify.current import CurrentData, currents
from ilg_circuit.identify.impedance import ImpedanceData
from ilg_circuit.identify.modal import modal_currents
from ilg_circuit.identify.port_model import IndividualFit, PortModel, port_problem
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.table import Table
from ilg_circuit.strip.models import electrical_model

Array = NDArray[np.float64]
#: A random generator -> name of each parameter and its interval
Trial = Callable[[np.random.Generator], dict[str, tuple[float, float]]]

BOUNDS, CORRELATED_BOUNDS = (0.93, 0.97), (0.90, 0.97)
OUT = Path(__file__).with_name("INTERVALS.md")


@dataclass(frozen=True)
class Case:
    """A model's true ``values``, Re ``held`` [ohm], and the noise, relative to abs(Z) or to the largest current."""

    values: tuple[float, ...]
    held: float
    noise: float


SPECTRA = {
    "rc": Case((233.0, 6.8, 0.02), 1.0, 0.005),
    "rc2": Case((400.0, 20.0, 0.01, 100.0, 0.02), 2.0, 0.005),
    "rc3": Case((1000.0, 10.0, 0.001, 50.0, 0.01, 100.0, 0.1), 0.0, 0.005),
    "warburg": Case((300.0, 10.0, 50.0, 2.0), 2.0, 0.005),
    "cpe": Case((1000.0, 10.0, 0.02, 0.8), 0.0, 0.005),
}
STEPS = {
    "rc": Case((233.0, 20.0, 0.2), 1.0, 0.01),
    "rc2": Case((400.0, 40.0, 0.02, 100.0, 0.1), 2.0, 0.002),
    "rc3": Case((1000.0, 60.0, 0.004, 100.0, 0.02, 150.0, 0.15), 0.0, 0.0005),
    "warburg": Case((300.0, 10.0, 50.0, 8.0), 2.0, 0.002),
}
#: Under both signs and two sizes of voltage, as a nonlinear model needs it.
LEVELS = {
    "rc+sinh": Case((400.0, 20.0, 0.2, 0.8), 0.0, 0.005),
    "rc+growing": Case((400.0, 20.0, 0.2, 0.3), 0.0, 0.005),
}
POINTS, SAMPLES, DURATION, STEP = 61, 301, 60.0, 2.0
#: Under noise whose neighbours correlate by phi, after so many samples of rest: ten correlation times or more.
CORRELATED = {f"{model}, phi {phi}": STEPS[model] for model in ("rc", "rc2", "warburg") for phi in (0.7, 0.9)}
RESTING, READINGS, SPACING, LARGER_STEP = 100, 500, 0.12, 4.0


def spectrum_trial(model: str) -> Trial:
    """Fits of spectra of 61 points from 1 mHz to 10 kHz."""
    case, kind = SPECTRA[model], electrical_model(model)
    f = np.geomspace(1e-3, 1e4, POINTS)
    z = kind.port(case.values, case.held).impedance(2j * np.pi * f, ideal=True)

    def trial(random: np.random.Generator) -> dict[str, tuple[float, float]]:
        noise = random.standard_normal(POINTS) + 1j * random.standard_normal(POINTS)
        data = ImpedanceData.of(Spectrum(model, f, z * (1 + case.noise * noise)))
        return intervals(data.individual(kind, case.held, None))

    return trial


def intervals(found: IndividualFit) -> dict[str, tuple[float, float]]:
    """The interval of each parameter that was fitted."""
    rows = zip(found.fit.labels, found.fit.intervals.tolist(), strict=True)
    return {label: (low, high) for label, (low, high) in rows}


def step_trial(model: str) -> Trial:
    """Fits of the current after a step of 2 V, 301 samples over 60 s."""
    return _current_trial(model, STEPS[model], PiecewiseLinear.step(STEP), "exact")


def level_trial(model: str) -> Trial:
    """Fits under a waveform of six levels of both signs, 301 samples over 60 s; ngspice, for nothing else can."""
    times = np.repeat(np.arange(0.0, DURATION, DURATION / 6), 2)[1:]
    levels = np.repeat([0.5, 2.0, -1.0, 1.0, -2.0, 0.0], 2)[:-1]
    return _current_trial(model, LEVELS[model], PiecewiseLinear(times, levels), "ngspice")


def _current_trial(model: str, case: Case, drive: PiecewiseLinear, engine: str) -> Trial:
    kind = electrical_model(model)
    t = np.linspace(0.0, DURATION, SAMPLES)
    clean = currents([kind.port(case.values, case.held)], drive, t, engine)[0]
    size = case.noise * float(np.abs(clean).max())

    def measured(random: np.random.Generator) -> Record:
        noisy = clean + size * random.standard_normal(SAMPLES)
        return prepare(Table({"time": t, "voltage": drive.value(t), "current": noisy}, "synthetic.csv"), "first-level")

    def trial(random: np.random.Generator) -> dict[str, tuple[float, float]]:
        record = measured(random)
        return intervals(CurrentData(record, engine, record.source).individual(kind, case.held, None))

    return trial


def correlated_trial(name: str) -> Trial:
    """Fits of the current after a step of 4 V, 500 samples over 60 s, the first 100 at rest, under AR(1) noise."""
    model, phi, case = name.split(",")[0], float(name.split()[-1]), CORRELATED[name]
    kind, t = electrical_model(model), np.asarray((np.arange(READINGS) - RESTING) * SPACING, dtype=np.float64)
    port, drive = PortModel(kind, case.held, case.values), PiecewiseLinear.step(LARGER_STEP)
    clean = np.zeros(READINGS)
    clean[t >= 0] = modal_currents([port.port(np.array(case.values))], drive, t[t >= 0])[0]
    size = case.noise * float(np.abs(clean).max())

    def trial(random: np.random.Generator) -> dict[str, tuple[float, float]]:
        noise = random.standard_normal(READINGS)
        for k in range(1, READINGS):
            noise[k] = phi * noise[k - 1] + np.sqrt(1 - phi**2) * noise[k]
        voltage = np.where(t >= 0, LARGER_STEP, 0.0)
        table = Table({"time": t - t[0], "voltage": voltage, "current": clean + size * noise}, "synthetic.csv")
        data = (CurrentData(prepare(table, "first-level"), "exact", "synthetic.csv"),)
        found = fit(port_problem(data, port, (1.0,)), np.array(case.values))
        return {label: estimate.reported[1] for label, estimate in uncertainties(found).estimates.items()}

    return trial


def coverage(
    trial: Trial, truth: dict[str, float], count: int, seed: int = 0, quiet: bool = False
) -> tuple[dict[str, float], int]:
    """Part of ``count`` trials in whose 95 % interval the truth lies, a parameter each; and how many gave no fit.

    A fit that fails says so and gives no interval, so it counts neither for nor against.
    """
    random = np.random.default_rng(seed)
    hits, failed = dict.fromkeys(truth, 0), 0
    for _ in tqdm(range(count), leave=False, disable=quiet or None):
        try:
            found = trial(random)
        except SolveError:
            failed += 1
            continue
        for name, value in truth.items():
            low, high = found.get(name, (np.inf, -np.inf))
            hits[name] += low <= value <= high
    return {name: hit / max(count - failed, 1) for name, hit in hits.items()}, failed


GROUPS: dict[str, tuple[dict[str, Case], Callable[[str], Trial]]] = {
    "spectrum": (SPECTRA, spectrum_trial),
    "step": (STEPS, step_trial),
    "levels": (LEVELS, level_trial),
    "autocorrelated": (CORRELATED, correlated_trial),
}


def truth_of(model: str, case: Case) -> dict[str, float]:
    return dict(zip(electrical_model(model.split(",")[0]).names, case.values, strict=True))


def main() -> list[Figure]:
    """Measure, print and write rows of the table; those outside 93 to 97 % say so."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    chosen = sys.argv[2:]
    figures = []
    for group, (cases, trials) in GROUPS.items():
        for model, case in cases.items():
            label = f"{group}:{model}"
            if chosen and label not in chosen and group not in chosen:
                continue
            found, failed = coverage(trials(model), truth_of(model, case), count)
            each = ", ".join(f"{name} {100 * part:.1f}" for name, part in found.items())
            mean = 100 * float(np.mean(list(found.values())))
            row = f"| {group} | {model} | {count} | {failed} | {mean:.1f} | {each} |"
            print(row, flush=True)
            _record(f"| {group} | {model} |", row)
            least, most = CORRELATED_BOUNDS if group == "autocorrelated" else BOUNDS
            outside = [name for name, part in found.items() if not least <= part <= most]
            told = f"{mean:.1f} % of {count - failed}"
            if outside:
                told += f"; OUTSIDE {least:.0%} to {most:.0%}: {', '.join(outside)}"
            figures.append(Figure(f"95 % intervals that hold the truth: {group}, {model}", told))
    return figures


def _record(key: str, row: str) -> None:
    """Put ``row`` into the file, in place of the one that begins with ``key``; the others stay."""
    known = OUT.read_text(encoding="utf-8").splitlines() if OUT.exists() else []
    rows = {r[: r.index("|", r.index("|", 2) + 1) + 1]: r for r in known if r.startswith("| ") and "---" not in r}
    rows.pop("| data | model |", None)
    rows[key] = row
    order = [f"| {group} | {model} |" for group, (cases, _) in GROUPS.items() for model in cases]
    lines = [*_HEAD, *(rows[k] for k in order if k in rows), ""]
    OUT.write_text("\n".join(lines), encoding="utf-8")


_HEAD = (
    "# Coverage of the 95 % intervals",
    "",
    "Written by `python benchmarks/intervals.py`: per cent of the data sets in whose interval the truth lies. Of 1000",
    "sets an honest interval gives 93 to 97, by chance less or more once in 250 times; of 500 once in 25.",
    "",
    "| data | model | sets | no fit | mean | each parameter |",
    "|---|---|---|---|---|---|",
)


if __name__ == "__main__":
    astray = [figure.stated for figure in main() if "OUTSIDE" in figure.measured]
    if astray:
        raise SystemExit("; ".join(astray))

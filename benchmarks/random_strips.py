"""What does `identify` say of strips, drives and noise that nobody chose? Random ones of known truth tell.

python benchmarks/random_strips.py [first] [count]     by default 0 and 60; prints what is not as it was made

Each number is one record: a strip of `tests/every_model.py`, 1 to 4 V as a step, squares, a sine, a triangle, a
staircase or lines for 1 to 10 min, 300 to 1,600 rows, noise of 0.1 to 2.5 % of the peak, a quarter of it AR(1) of 0.7.
"Off" are values more than four of their errors from the truth. Not all that is listed is a fault: a sinh path under
two levels is a resistor, and one frequency does not tell one branch from two.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from sets import noise_of

import ilg_circuit as ilg
from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.errors import IlgError
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.elements import lumped_port
from ilg_circuit.strip.models import electrical_model

TESTS = Path(__file__).parents[1] / "tests"
MODELS = (
    *("rc", "rc2", "rc3", "warburg", "rc+sinh", "rc+growing", "rc+saturating", "rc+steric", "rc2+sinh", "rc2+growing"),
    "warburg+sinh",
)
DRIVES = ("step", "square", "square from 0 V", "sine", "triangle", "staircase", "lines")
#: Correlation of neighbours of autocorrelated noise.
PHI = 0.7
#: Errors from the truth from which on a value is off.
OFF = 4.0


@dataclass(frozen=True)
class Made:
    """A record of a strip of ``model`` under a drive of some ``kind``: its ``columns``, and its noise over the peak."""

    model: str
    kind: str
    noise: float
    columns: dict[str, np.ndarray]


def drive_of(kind: str, random: np.random.Generator, volts: float, end: float) -> Drive:
    """A drive that ends after ``end`` [s]."""
    period = end / random.uniform(2.2, 8.0)
    if kind == "step":
        return PiecewiseLinear.step(volts)
    if kind.startswith("square"):
        return PiecewiseLinear.square(0.0 if "0 V" in kind else -volts, volts, period, end)
    if kind == "sine":
        return Sine(volts, 1 / period)
    if kind == "triangle":
        corners = np.arange(int(4 * end / period) + 2)
        return PiecewiseLinear(corners * period / 4, volts * np.array([0.0, 1.0, 0.0, -1.0])[corners % 4])
    count = int(random.integers(4, 10))
    times = end * np.sort(random.uniform(0.05, 0.95, count - 1))
    levels = random.uniform(-volts, volts, count)
    if kind == "lines":
        return PiecewiseLinear(np.append(0.0, times), np.append(0.0, levels[1:]))
    return PiecewiseLinear(np.append(0.0, np.repeat(times, 2)), np.repeat(levels, 2)[:-1])


def made(number: int) -> Made:
    """The record of a number."""
    import every_model

    random = np.random.default_rng(number)
    model, kind = str(random.choice(MODELS)), str(random.choice(DRIVES))
    end, rows = float(random.choice([60.0, 120.0, 300.0, 600.0])), int(random.choice([300, 600, 1600]))
    drive = drive_of(kind, random, random.uniform(1.0, 4.0), end)
    strip, t, rest = every_model.strip_of(model), np.linspace(0.0, end, rows), int(random.integers(10, 40))
    run = simulate(strip, drive, t, beam="static", engine="exact" if lumped_port(strip).linear else "ngspice")
    noise, phi = 10 ** random.uniform(-3.0, -1.6), float(random.choice([0.0, 0.0, 0.0, PHI]))

    def noisy(values: np.ndarray, size: float, phi: float = 0.0) -> np.ndarray:
        return np.append(np.zeros(rest), values) + size * noise_of(random, rows + rest, phi)

    columns = {
        "time_s": t[1] * np.arange(rows + rest),
        "voltage_V": noisy(run.voltage, 1e-3),
        "current_A": noisy(run.current, noise * float(np.abs(run.current).max()), phi),
    }
    if random.random() < 0.6:
        columns["displacement_m"] = noisy(run.displacement, noise * float(np.abs(run.displacement).max()))
    return Made(model, kind, noise, columns)


def told(record: Made) -> tuple[str, str, float]:
    """How a record came out, in a word and in words, and the processor time [s] of its fit."""
    import every_model

    begin = process_time()
    try:
        found = ilg.identify(record.columns, "paper")
    except IlgError as error:
        return "refused", str(error), process_time() - begin
    took = process_time() - begin
    truth = zip(electrical_model(record.model).names, every_model.values_of(record.model), strict=True)
    errors = {
        name: (found[name].value - value) / found[name].reported[0]
        for name, value in truth
        if name in found.parameters and found[name].reported is not None
    }
    off = [f"{name} {z:+.0f}" for name, z in errors.items() if abs(z) > OFF]
    current = found.observations[0]
    words = f"{found.model}, misfit {current.rms_joint / current.size / record.noise:.2f} of the noise"
    words += ("; off: " + ", ".join(off) if off else "") + ("" if found.success else "; no success")
    return "off" if off else "as made" if found.model == record.model else "another model", words, took


def main(first: int, count: int) -> None:
    """Fit the records, and print what is not as it was made, how many are what, and the slowest."""
    sys.path.insert(0, str(TESTS))
    outcomes: dict[str, int] = {}
    slowest = (0.0, 0)
    for number in range(first, first + count):
        record = made(number)
        outcome, words, took = told(record)
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        slowest = max(slowest, (took, number))
        if outcome != "as made":
            print(f"{number}: {record.model} under {record.kind}, noise {record.noise:.2%}: {words} ({took:.1f} s)")
    print(
        ", ".join(f"{n} {outcome}" for outcome, n in outcomes.items()), f"- slowest {slowest[0]:.1f} s ({slowest[1]})"
    )


if __name__ == "__main__":
    main(*(int(x) for x in (sys.argv[1:] + ["0", "60"][len(sys.argv) - 1 :])))

"""What a strip as a line of cells costs beside one lump, and how its error falls with the number of cells.

Writes LINE.md beside this file. python benchmarks/line.py
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from figure import Figure
from machine import conditions

from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.response import simulate
from ilg_circuit.solve.spectrum import spectrum
from ilg_circuit.strip.actuator import PAPER, Actuator, Electrodes
from ilg_circuit.strip.elements import lumped_port

CELLS, ACCURACY, RUNS = 40, 1e-6, 7
TIMES = np.linspace(0.0, 300.0, 601)
STEP = PiecewiseLinear.step(4.0)
#: Sheet resistance [ohm] per square and frequency [Hz] of the errors.
PLACES = ((0.244, 0.1), (5.0, 0.1), (200.0, 0.1), (200.0, 0.001))
COUNTS = (10, 20, 40)


def cost(strip: Actuator, engine: str, beam: str) -> float:
    """Least processor time [s] of a run, the first one apart."""
    found = []
    for _ in range(RUNS + 1):
        begin = process_time()
        simulate(strip, STEP, TIMES, engine=engine, beam=beam, accuracy=ACCURACY)
        found.append(process_time() - begin)
    return min(found[1:])


def line(sheet: float, cells: int, **others: Any) -> Actuator:
    return replace(PAPER, electrodes=Electrodes(sheet, sheet, cells=cells, **others))


def error(sheet: float, frequency: float, cells: int) -> float:
    """Error of the impedance of the strip as a line of 35 mm, by sqrt(r/y) coth(gamma L)."""
    strip = line(sheet, cells, contact="end")
    strip = replace(strip, geometry=replace(strip.geometry, free_length=strip.geometry.length))
    length, width = strip.geometry.length, strip.geometry.width
    along = 2 * sheet / width
    gamma = np.sqrt(along / complex(lumped_port(PAPER).impedance(2j * np.pi * frequency)) / length)
    exact = along / gamma / np.tanh(gamma * length)
    found = spectrum(strip_netlist(strip, beam="static"), [frequency], engine="exact").output("current")[0]
    return float(abs(1 / found / exact - 1))


def main() -> list[Figure]:
    """Measure, print and write the tables."""
    strip = line(0.25, CELLS)
    runs = [(beam, engine) for beam in ("static", "dynamic") for engine in ("ngspice", "exact")]
    rows = [(beam, engine, *(cost(one, engine, beam) for one in (PAPER, strip))) for beam, engine in runs]
    lines = [
        "# The strip as a line",
        "",
        *conditions(("numpy", "scipy")),
        "",
        f"A step of 4 V over 300 s at {ACCURACY:g}, 601 samples, energies included: one lump, and a line of {CELLS}",
        f"cells with their curvatures. Least processor time of {RUNS} runs. Remade by `python benchmarks/line.py`.",
        "",
        "| beam | engine | one lump | line | ratio |",
        "|---|---|---|---|---|",
        *(f"| {b} | {e} | {1e3 * one:.0f} ms | {1e3 * all_:.0f} ms | {all_ / one:.1f} |" for b, e, one, all_ in rows),
        "",
        "Error of the impedance at the terminals against the transmission line, by the number of cells:",
        "",
        "| sheets, per square | frequency | " + " | ".join(f"{n} cells" for n in COUNTS) + " |",
        "|---|---|" + "---|" * len(COUNTS),
    ]
    for sheet, frequency in PLACES:
        found = " | ".join(f"{error(sheet, frequency, n):.1e}" for n in COUNTS)
        lines.append(f"| {sheet:g} ohm | {frequency:g} Hz | {found} |")
    text = "\n".join(lines) + "\n"
    Path(__file__).with_name("LINE.md").write_text(text, encoding="utf-8")
    print(text)
    return [
        Figure(f"a line of {CELLS} cells over one lump, {engine}, {beam} beam", f"{all_ / one:.1f} times the time")
        for beam, engine, one, all_ in rows
    ]


if __name__ == "__main__":
    main()

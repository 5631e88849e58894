"""How often the 95 % interval of the resistance along a strip, from its shape, holds the true one; writes SHAPE.md.

    python benchmarks/shape_coverage.py [SETS]

Marks with independent noise on the paper's strip, by the closed form of the line, under a sine and at rest; their
places are known, or are their own x at rest. Every set is drawn from a seed of its own.
"""

from __future__ import annotations

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from figure import Figure

import ilg_circuit as ilg
from ilg_circuit.identification.shape import _admittance, bent_line, curved_line

LENGTH, WIDTH = ilg.PAPER.geometry.free_length, ilg.PAPER.geometry.width
NOISE, MARKS = 10e-6, 6
PLACES = np.linspace(5e-3, LENGTH, MARKS)
#: Case -> frequency [Hz], resistance of both sheets [ohm per square], curvature at the clamp [1/m], places known.
CASES = {
    "sine of 0.1 Hz, 2 ohm": (0.1, 2.0, 12.0, True),
    "sine of 0.1 Hz, 10 ohm": (0.1, 10.0, 12.0, True),
    "at rest, 300 ohm, tip turned by 0.5 rad": (None, 300.0, 25.0, True),
    "at rest, 300 ohm, places from the marks": (None, 300.0, 25.0, False),
}


def tracks(case: str, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times (n,), x and y (n, marks) of a set."""
    frequency, resistance, bend, _ = CASES[case]
    random = np.random.default_rng(seed)
    square = resistance / WIDTH * _admittance(ilg.PAPER, frequency) * LENGTH**2
    if frequency is None:
        ends = bent_line(PLACES, LENGTH, bend, square.real)
        t = np.concatenate([np.linspace(-20, 0, 21), np.linspace(280, 300, 21)])
        x, y = (np.repeat([first, last], 21, axis=0) for first, last in ((PLACES, ends.real), (0 * PLACES, ends.imag)))
    else:
        t = np.arange(0.0, 30.0, 0.1)
        amplitude = bend * curved_line(PLACES, LENGTH, square)
        y = np.real(amplitude * np.exp(2j * np.pi * frequency * t)[:, None])
        x = np.tile(PLACES, (len(t), 1))
    return t, x + NOISE * random.normal(size=x.shape), y + NOISE * random.normal(size=x.shape)


def measured(case: str, sets: int) -> str:
    """Return the row of a case."""
    frequency, resistance, _, known = CASES[case]
    begin, held, values, errors = time.process_time(), 0, [], []
    for seed in range(sets):
        places = PLACES.tolist() if known else None
        fit = ilg.identify_shape(tracks(case, seed), ilg.PAPER, frequency=frequency, places=places)
        estimate = fit["sheet_resistance"]
        low, high = estimate.interval or (np.nan, np.nan)
        held += low <= resistance <= high
        values.append(estimate.value)
        errors.append(estimate.stderr)
    return (
        f"| {case} | {held / sets:.1%} | {np.mean(values) / resistance - 1:+.2%} | {np.std(values) / resistance:.2%} | "
        f"{np.mean(errors) / resistance:.2%} | {(time.process_time() - begin) / sets:.2f} |"
    )


def main() -> list[Figure]:
    """Fit all sets, a process for each case, print and write the table."""
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    with ProcessPoolExecutor(len(CASES)) as pool:
        lines = list(pool.map(measured, CASES, [sets] * len(CASES)))
    print("\n".join(lines))
    text = Path(__file__).with_name("SHAPE.md")
    head = [
        "# The resistance along a strip from its shape",
        "",
        f"Written by `python benchmarks/shape_coverage.py {sets}`: {sets} sets of {MARKS} marks a case, "
        f"noise {1e6 * NOISE:g} um.",
        f"ilg-circuit {ilg.__version__}, numpy {np.__version__}.",
        "",
        "| case | 95 % intervals that hold | bias | spread | mean standard error | s of one core a fit |",
        "|---|---|---|---|---|---|",
    ]
    text.write_text("\n".join([*head, *lines, ""]), encoding="utf-8")
    cells = [line.strip("| ").split(" | ") for line in lines]
    return [Figure(f"95 % intervals of sheet_resistance that hold the truth: {case}", held) for case, held, *_ in cells]


if __name__ == "__main__":
    main()

"""The resistance along a strip from its shape: the line against cells of it, round trips, files, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line

import ilg_circuit as ilg
from ilg_circuit.errors import InputError
from ilg_circuit.files import write_csv
from ilg_circuit.identification.shape import bent_line, curved_line
from ilg_circuit.measurements.marks import read_marks
from ilg_circuit.simulation.curvature import Curvatures
from ilg_circuit.simulation.shape import arcs

LENGTH, WIDTH, RESISTANCE, FREQUENCY = 0.03, 5e-3, 10.0, 0.1
PLACES = np.linspace(5e-3, LENGTH, 6)


def admittance(frequency: float) -> complex:
    """Return the paper's port, per length: Rdc beside Rd and C in series."""
    s = 2j * np.pi * frequency
    return complex(1 / 666.667 + (0.35 * s / (1 + 19.43635 * 0.35 * s) if s else 0)) / 0.035


def voltages(square: complex, cells: int = 400) -> np.ndarray:
    """Return the voltages of a line's cells, from its ladder: half a cell's resistance on both sides of each shunt."""
    step = square / cells**2
    matrix = np.diag(np.full(cells, 2 + step)) - np.diag(np.ones(cells - 1), 1) - np.diag(np.ones(cells - 1), -1)
    matrix[0, 0] += 1  # half a cell to the source
    matrix[-1, -1] -= 1  # an open end
    right = np.zeros(cells, dtype=complex)
    right[0] = 2.0
    return np.linalg.solve(matrix, right)


@pytest.mark.parametrize("square", [1e-6, 1.5, 0.4 + 0.3j, 2.6 + 0.59j, 144 + 20j])
def test_the_line_is_that_of_its_cells(square: complex) -> None:
    v, edges = voltages(square), np.linspace(0, LENGTH, 401)
    middle = (edges[1:] + edges[:-1]) / 2
    expected = [((x - middle) * v)[middle < x].sum() * edges[1] for x in PLACES]
    found = curved_line(PLACES, LENGTH, square)
    np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(found).max())
    if not np.imag(square):  # large deflections, by arcs
        x, y, _ = arcs(Curvatures(np.zeros(1), np.diff(edges), 40.0 * v.real[None]), PLACES)
        np.testing.assert_allclose(bent_line(PLACES, LENGTH, 40.0, square.real), x[0] + 1j * y[0], atol=1e-7)


@pytest.mark.parametrize(("sheets", "ratio"), [(0.244, 0.970), (5.0, 0.669), (200.0, 0.175)])
def test_the_tip_moves_by_less_than_that_of_an_equipotential_strip(sheets: float, ratio: float) -> None:
    square = 2 * sheets / WIDTH * admittance(FREQUENCY) * LENGTH**2
    found = curved_line(np.array([LENGTH]), LENGTH, square)[0] / (LENGTH**2 / 2)
    g = np.sqrt(square)
    assert found == pytest.approx(2 / g**2 * (g * np.tanh(g) - (1 - 1 / np.cosh(g))), rel=1e-9)
    assert abs(found) == pytest.approx(ratio, abs=5e-4)


def sine(noise: float = 5e-6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    t = np.arange(0.0, 20.0, 0.1)
    square = RESISTANCE / WIDTH * admittance(FREQUENCY) * LENGTH**2
    amplitude = (12 - 5j) * curved_line(PLACES, LENGTH, square)
    y = np.real(amplitude * np.exp(2j * np.pi * FREQUENCY * t)[:, None]) + noise * random.normal(size=(len(t), 6))
    return t, np.tile(PLACES, (len(t), 1)), y


def test_resistance_from_a_sine_and_what_the_shape_alone_tells() -> None:
    fit = ilg.identify_shape(sine(), "paper", frequency="100 mHz")
    low, high = fit["sheet_resistance"].interval or (0.0, 0.0)
    assert low < RESISTANCE < high < 1.05 * RESISTANCE
    (warning,) = fit.warnings
    assert "product r y" in warning
    alone = ilg.identify_shape(sine(), "paper", frequency=FREQUENCY, port=False)
    assert alone.warnings == ()
    square = RESISTANCE / WIDTH * admittance(FREQUENCY) * LENGTH**2
    for part in ("re", "im"):
        estimate = alone[f"gamma_length_squared_{part}"]
        assert abs(estimate.value - (square.real if part == "re" else square.imag)) < 4 * (estimate.stderr or 0.0)
    assert abs(alone.gamma_length) == pytest.approx(abs(fit.gamma_length), rel=0.02)


def test_resistance_of_a_strip_at_rest_with_large_deflection(run: Run) -> None:
    random = np.random.default_rng(5)
    square = (300 / WIDTH * admittance(0.0) * LENGTH**2).real
    ends = bent_line(PLACES, LENGTH, 60.0, square)
    t = np.append(np.linspace(-20.0, 0.0, 21), np.linspace(280.0, 300.0, 21))
    noise = 1e-5 * random.normal(size=(2, 42, 6))
    tracks = {"time_s": t}
    for k, (s, end) in enumerate(zip(PLACES, ends, strict=True)):
        tracks[f"x{k + 1}_mm"] = 1e3 * (np.repeat([s, end.real], 21) + noise[0, :, k])
        tracks[f"y{k + 1}_mm"] = 1e3 * (np.repeat([0.0, end.imag], 21) + noise[1, :, k])
    write_csv("marks.csv", tracks)
    done = run("identify", "--shape", "marks.csv", "--actuator", "paper", "--json", "fit.json", "--plot", "fit.png")
    assert done.code == 0, done.err
    assert "sheet_resistance" in done.out
    found = json.loads(Path("fit.json").read_text())["parameters"]["sheet_resistance"]
    low, high = found["ci95"]
    assert low < 300 < high < 1.1 * 300
    assert Path("fit.png").stat().st_size > 10_000
    for k in range(6):  # a file for each mark
        write_csv(f"m{k}.csv", {"time_s": t, "x_mm": tracks[f"x{k + 1}_mm"], "y_mm": tracks[f"y{k + 1}_mm"]})
    one, several = read_marks(["marks.csv"]), read_marks([f"m{k}.csv" for k in range(6)])
    np.testing.assert_array_equal([*one.times, *one.x, *one.y], [*several.times, *several.x, *several.y])
    assert len(one) == 6


def test_a_resistance_that_is_not_seen_is_said() -> None:
    t, x, _ = sine()
    random = np.random.default_rng(8)
    y = np.cos(2 * np.pi * FREQUENCY * t)[:, None] * 6 * PLACES**2 + 1e-4 * random.normal(size=(len(t), 6))
    fit = ilg.identify_shape((t, x, y), "paper", frequency=FREQUENCY)
    assert any("from zero" in warning for warning in fit.warnings)


def test_refusals(run: Run) -> None:
    t, x, y = sine()
    for marks, how, words in (
        ((t, x + 0.01, y), {}, "free length"),
        ((t, x, y), {"places": "5mm,10mm"}, "6 marks"),
        ((t, x, y), {"frequency": "1 mHz"}, "period"),
        ((t, x, y), {"frequency": 0.0}, "more than zero"),
        ((t, x, y[:5]), {}, "shapes"),
        ((t, x[:, :1], y[:, :1]), {"frequency": FREQUENCY}, "do not determine"),
        ([], {}, "no marks"),
    ):
        with pytest.raises(InputError, match=words):
            ilg.identify_shape(marks, "paper", **how)  # type: ignore[arg-type]
    Path("odd.csv").write_text("time_s,x1_mm,y2_mm\n0,10,0\n1,10,1\n")
    with pytest.raises(InputError, match="y1_mm"):
        read_marks(["odd.csv"])
    Path("one.csv").write_text("time_s,x_mm,y_mm\n0,10,0\n1,10,1\n")
    assert_one_line(run("identify", "--shape", "one.csv"), "--actuator")
    assert_one_line(run("identify", "--shape", "one.csv", "--actuator", "paper", "--model", "rc"), "--model")
    assert_one_line(run("identify", "one.csv", "--frequency", "1Hz"), "--shape")

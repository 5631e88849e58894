"""NIST's nonlinear-regression problems (StRD), whose parameters and standard errors are certified to eleven digits.

The files lie beside the project; whichever of the 27 are there are fitted, each from both of its starts.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ilg_circuit.errors import SolveError
from ilg_circuit.fit.curve import fit_curve

DATA = Path(__file__).parents[2].parent / "shared" / "data" / "nist"
FILES = sorted(DATA.glob("*.dat"))

pytestmark = pytest.mark.skipif(not FILES, reason="NIST's files are not beside the project")

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """One file: data, both starts (2, n), certified values and standard deviations (n,), residual sum of squares."""

    name: str
    x: Array
    y: Array
    starts: Array
    values: Array
    errors: Array
    squares: float


def read(path: Path) -> Problem:
    text = path.read_text()
    rows = re.findall(r"^\s*b\d+\s*=(.*)$", text, re.MULTILINE)
    table = np.array([[float(cell) for cell in row.split()] for row in rows])
    body = text[text.rindex("Data:") :].splitlines()[1:]
    data = np.array([[float(cell) for cell in line.split()] for line in body if line.strip()])
    found = re.search(r"Residual Sum of Squares:\s*(\S+)", text)
    assert found is not None
    y, x = data[:, 0], data[:, 1] if data.shape[1] == 2 else data[:, 1:].T
    if path.stem == "Nelson":
        y = np.log(y)
    return Problem(path.stem, x, y, table[:, :2].T, table[:, 2], table[:, 3], float(found[1]))


def _rational(x: Any, up: list[float], down: list[float]) -> Any:
    above = sum(b * x**k for k, b in enumerate(up))
    return above / (1 + sum(b * x ** (k + 1) for k, b in enumerate(down)))


def _decays(x: Any, *b: float) -> Any:
    return sum(a * np.exp(-rate * x) for a, rate in zip(b[0::2], b[1::2], strict=True))


def _peaks(x: Any, *b: float) -> Any:
    first = b[2] * np.exp(-(((x - b[3]) / b[4]) ** 2))
    return b[0] * np.exp(-b[1] * x) + first + b[5] * np.exp(-(((x - b[6]) / b[7]) ** 2))


def _enso(x: Any, *b: float) -> Any:
    total = b[0] + b[1] * np.cos(2 * np.pi * x / 12) + b[2] * np.sin(2 * np.pi * x / 12)
    for period, even, odd in ((b[3], b[4], b[5]), (b[6], b[7], b[8])):
        total = total + even * np.cos(2 * np.pi * x / period) + odd * np.sin(2 * np.pi * x / period)
    return total


def _saturating(x: Any, b1: float, b2: float) -> Any:
    return b1 * (1 - np.exp(-b2 * x))


def _falling(x: Any, b1: float, b2: float, b3: float) -> Any:
    return np.exp(-b1 * x) / (b2 + b3 * x)


MODELS: dict[str, Any] = {
    "Bennett5": lambda x, a, b, c: a * (b + x) ** (-1 / c),
    "BoxBOD": _saturating,
    "Chwirut1": _falling,
    "Chwirut2": _falling,
    "DanWood": lambda x, a, b: a * x**b,
    "ENSO": _enso,
    "Eckerle4": lambda x, a, b, c: a / b * np.exp(-0.5 * ((x - c) / b) ** 2),
    "Gauss1": _peaks,
    "Gauss2": _peaks,
    "Gauss3": _peaks,
    "Hahn1": lambda x, *b: _rational(x, list(b[:4]), list(b[4:])),
    "Kirby2": lambda x, *b: _rational(x, list(b[:3]), list(b[3:])),
    "Lanczos1": _decays,
    "Lanczos2": _decays,
    "Lanczos3": _decays,
    "MGH09": lambda x, a, b, c, d: a * (x**2 + x * b) / (x**2 + x * c + d),
    "MGH10": lambda x, a, b, c: a * np.exp(b / (x + c)),
    "MGH17": lambda x, a, b, c, d, e: a + b * np.exp(-x * d) + c * np.exp(-x * e),
    "Misra1a": _saturating,
    "Misra1b": lambda x, a, b: a * (1 - (1 + b * x / 2) ** -2),
    "Misra1c": lambda x, a, b: a * (1 - (1 + 2 * b * x) ** -0.5),
    "Misra1d": lambda x, a, b: a * b * x / (1 + b * x),
    "Nelson": lambda x, a, b, c: a - b * x[0] * np.exp(-c * x[1]),
    "Rat42": lambda x, a, b, c: a / (1 + np.exp(b - c * x)),
    "Rat43": lambda x, a, b, c, d: a / (1 + np.exp(b - c * x)) ** (1 / d),
    "Roszman1": lambda x, a, b, c, d: a - b * x - np.arctan(c / (x - d)) / np.pi,
    "Thurber": lambda x, *b: _rational(x, list(b[:4]), list(b[4:])),
}


def test_the_equations_are_the_files() -> None:
    """The certified values leave the certified sum of squares: reader and equations are right."""
    for problem in map(read, FILES):
        rest = problem.y - MODELS[problem.name](problem.x, *problem.values)
        tolerance = 1e-8 if problem.squares > 1e-12 else 0.5  # of Lanczos1's data, exact to 14 digits
        assert float(rest @ rest) == pytest.approx(problem.squares, rel=tolerance), problem.name


@pytest.mark.parametrize("start", [0, 1], ids=["first start", "second start"])
@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_certified(path: Path, start: int) -> None:
    problem = read(path)
    found = fit_curve(MODELS[problem.name], problem.x, problem.y, problem.starts[start])
    assert found.values == pytest.approx(problem.values, rel=1e-6)
    assert found.starts.agreeing >= 2
    if problem.name != "Lanczos1":  # its residuals are the rounding of its data
        assert found.errors == pytest.approx(problem.errors, rel=1e-4)
        assert found.sum_of_squares == pytest.approx(problem.squares, rel=1e-6)


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_any_luck_gives_the_certified_values_or_an_error(path: Path) -> None:
    """Starts ten times off in every parameter: right, or refused, never wrong."""
    problem = read(path)
    random = np.random.default_rng(1)
    start = problem.starts[1] * 10.0 ** random.uniform(-1, 1, len(problem.values))
    try:
        found = fit_curve(MODELS[problem.name], problem.x, problem.y, start, seed=1)
    except SolveError:
        return
    rest = problem.y - MODELS[problem.name](problem.x, *found.values)
    assert float(rest @ rest) == pytest.approx(problem.squares, rel=1e-6, abs=1e-20)

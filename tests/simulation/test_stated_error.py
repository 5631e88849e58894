"""The error that a run states bounds the true one: fewer of the runs of benchmarks/stated_error.py, and its causes."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate, transient_band
from ilg_circuit.solve.grid import design_grid
from ilg_circuit.strip.actuator import PAPER

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
#: Few enough unknowns for a fast test; two in five are ladders, as in the benchmark.
LINEAR = ("rc", "rc2", "rc+inductance", "cpe", "cpe")
NONLINEAR = ("rc+growing", "rc2+growing", "rc2+sinh", "rc+sinh", "cpe+sinh")


@pytest.fixture
def stated(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("stated_error")


@pytest.mark.parametrize(
    ("models", "count", "engine"), [(LINEAR, 6, "ngspice"), (NONLINEAR, 10, "ngspice"), (LINEAR, 15, "exact")]
)
def test_it_bounds_the_true_one(stated: ModuleType, models: tuple[str, ...], count: int, engine: str) -> None:
    """In every one of the runs: one in a hundred is allowed to miss. In the median it is no hundred times larger."""
    found = [run for run in stated.runs(count, models, 11, engine) if not isinstance(run, str)]
    assert len(found) >= 0.7 * count
    assert not [run.line() for run in found if run.ratio > 1]
    assert np.median([run.larger for run in found]) <= 100


@pytest.mark.parametrize("seeds", [(104729, 82), (104729, 125), (20261126, 2)])
def test_it_bounds_the_true_one_where_it_did_not(stated: ModuleType, seeds: tuple[int, int]) -> None:
    """Of a charge that passes zero right after an edge, of Newton's iterations, of samples beside charges at zero."""
    found = stated.judged(*stated.random_run(np.random.default_rng(seeds), stated.NONLINEAR))
    assert found.ratio <= 1


def test_the_reference_is_the_reference_of_thirty_digits(stated: ModuleType) -> None:
    """Modes against mpmath's inversion of the Laplace transform of a finite Warburg element behind Rs, beside Rdc."""
    import mpmath

    equations = importlib.import_module("strip_equations")
    strip = stated.random_strip(np.random.default_rng(0), "warburg", 10.0)
    strip = replace(strip, coupling=None)
    run = equations.Run(strip, PiecewiseLinear.step(1.0), np.array([0.0, 0.01, 1.0, 10.0]))
    e = equations.lumped(run, float)
    (rs, farad), tau = e["branches"][0], e["constants"]["diffusion_time"]

    def admittance(s: object) -> object:
        x = mpmath.sqrt(s * tau)
        ions = rs + tau / farad * mpmath.coth(x) / x
        return 1 / (s * (e["re"] + 1 / (1 / e["dc"] + 1 / ions)))

    expected = [float(mpmath.invertlaplace(admittance, t, method="talbot")) for t in run.times[1:]]
    found = equations.linear_reference(run, equations.modes_of(run))["current"]
    assert found[1:] == pytest.approx(expected, rel=1e-6)
    assert found[0] == pytest.approx(1 / (e["re"] + 1 / (1 / e["dc"] + 1 / rs)), rel=1e-9)


def test_samples_do_not_change_the_circuit() -> None:
    few, many = (transient_band(np.linspace(0, 30, n)) for n in (3, 30001))
    assert few == many


def test_a_ladder_s_error_is_in_the_figure(stated: ModuleType) -> None:
    """Of sections too few by far the error is that of the ladder, and told."""
    run, _ = stated.random_run(np.random.default_rng(1), ("cpe",))
    coarse = replace(run.strip, material=replace(run.strip.material, ladder_sections=4.0))
    few = stated.judged(replace(run, strip=coarse), "few sections", "exact")
    assert few.ratio <= 1
    assert few.larger <= 100
    assert max(few.true.values()) > 1e-4


def test_a_jump_keeps_its_first_three_moments() -> None:
    """Of the drive's difference from the jump, integrated against 1, t and t^2."""
    drive = parse_drive("square:-1V..3V,2s", 3.0)
    grid = design_grid(np.array([-5.0 + 0j]), drive, np.linspace(0, 3, 7), 0.3)
    edge = 1.0
    t = edge + grid.rise * np.linspace(-0.5, 0.5, 40001)
    off = grid.voltages(drive, t) - np.where(t < edge, 3.0, -1.0)
    scaled = (t - edge) / grid.rise
    assert np.abs(off).max() > 1
    for power in range(3):
        assert abs(np.trapezoid(off * scaled**power, scaled)) <= 1e-4


def test_the_exact_engine_states_its_rounding() -> None:
    found = simulate(PAPER, parse_drive("square:4V,30s", 100.0), np.linspace(0, 100, 101), engine="exact")
    assert 1e-15 < found.error < 1e-10

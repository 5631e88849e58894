"""The same network by ngspice."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ilg_circuit.errors import InputError, SolveError
from ilg_circuit.oscillators import netlist
from ilg_circuit.oscillators.flow import Flow, sampled
from ilg_circuit.oscillators.netlist import deck, measured, netlist_text, sampled_by_ngspice, solve
from ilg_circuit.oscillators.network import Network, chain, default_start, ring, unit
from ilg_circuit.oscillators.rhythm import rhythm

UNEVEN = Network(
    [[0, 2.1, 0.4], [2.2, 0, 0.3], [0.3, 0.2, 0]], adaptation=2.5, tonic=2.0, rise_time=0.05, adaptation_time=0.4
)


@pytest.mark.parametrize(
    "network",
    [unit(), unit(1.45), unit(1.4001), ring(3), ring(3, 3.0, one_way=True), ring(5), chain(2), UNEVEN],
    ids=["unit", "near the edge", "at the edge", "ring", "one-way", "five", "chain", "uneven"],
)
def test_ngspice_agrees_with_the_exact_flow(network: Network) -> None:
    exact = rhythm(network)
    assert exact.outcome == "cycle"
    period, amplitude, error = measured(exact)
    assert error <= 1e-5
    assert period == pytest.approx(exact.period, rel=error)  # the stated error is honest
    assert amplitude == pytest.approx(exact.amplitude, rel=error)


def test_the_waves_agree_from_the_start_on() -> None:
    times = np.linspace(0, 3, 301)
    inner, error = sampled_by_ngspice(unit(), times)
    exact = sampled(Flow(unit()), default_start(unit()), times)[:, :2]
    assert error < 1e-4
    assert inner == pytest.approx(exact, abs=2 * error * np.abs(exact).max())


def test_networks_that_rest_do_so_in_ngspice() -> None:
    for network in (unit(5.0), unit(1.0), ring(4)):
        exact = rhythm(network)
        assert exact.rest is not None
        _, inner = solve(network, 30.0, 6000)
        assert inner[:, -1] == pytest.approx(exact.rest[: network.size], abs=1e-6)


def test_the_error_falls_as_the_square_of_the_step() -> None:
    """So it is the grid that decides, and not the tolerances that ngspice is given for linear circuits."""
    times = np.linspace(0, 2, 51)
    exact = sampled(Flow(unit()), default_start(unit()), times)[:, 0]
    errors = []
    for points in (500, 2000, 8000):
        _, inner = solve(unit(), 2.0, points)
        errors.append(np.abs(inner[0, :: points // 50] - exact).max())
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.5)
    assert errors[1] / errors[2] == pytest.approx(16, rel=0.5)


def test_every_number_is_written_in_full() -> None:
    text = netlist_text(Network([[0, 1 / 3], [-2e-7, 0]], tonic=0.1, rise_time=1 / 7))
    assert "Gw1_2 x1 0 y2 0 0.3333333333333333" in text
    assert "Gw2_1 x2 0 y1 0 -2e-07" in text
    assert "Cx1 x1 0 0.14285714285714285 ic=0.12" in text
    assert "It2 0 x2 0.1" in text
    assert "Gw1_1" not in text


@pytest.mark.skipif(shutil.which("ngspice") is None, reason="the program ngspice is not installed here")
def test_the_deck_runs_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "cpg.cir").write_text(deck(unit(), 2.0))
    done = subprocess.run(["ngspice", "-n", "-b", "cpg.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines() if line[:1].isdigit()]
    table = np.array([[float(cell) for cell in row] for row in rows if len(row) == 5])
    assert len(table) > 1000
    exact = np.maximum(sampled(Flow(unit()), default_start(unit()), table[:, 1])[:, :2], 0)
    assert table[:, 2:4] == pytest.approx(exact, abs=1e-4)
    assert table[:, 4] == pytest.approx(exact[:, 0] - exact[:, 1], abs=1e-4)


def test_what_cannot_be_measured() -> None:
    with pytest.raises(InputError, match="there is no cycle to measure"):
        measured(rhythm(unit(5.0)))
    with pytest.raises(InputError, match="duration 0 s must be more than zero"):
        solve(unit(), 0.0, 100)
    with pytest.raises(InputError, match="at most 2000000 are possible"):
        solve(unit(), 1.0, 3_000_000)
    with pytest.raises(InputError, match="duration nan s"):
        deck(unit(), float("nan"))


def test_an_accuracy_that_is_not_reached_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(netlist, "_MOST_GRIDS", 3)
    with pytest.raises(SolveError, match="left a relative error of"):
        measured(rhythm(unit()), accuracy=1e-12)

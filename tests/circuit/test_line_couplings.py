"""A strip with sheet resistance that bends by relaxations of charge or voltage: each cell by its own charge."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from relaxing_strips import COUPLINGS, TWO, strip
from scipy.integrate import solve_ivp
from spice import ngspice, table, with_ngspice

import ilg_circuit as ilg
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import Actuator, Electrodes
from ilg_circuit.strip.couplings import ChargeCoupling
from ilg_circuit.strip.elements import lumped_elements

STEP = PiecewiseLinear.step(4.0)
T = np.linspace(0.0, 60.0, 13)
#: Couplings that a dynamic beam can have: an instantaneous part of the charge has a rate.
CASES = [(name, beam) for name in COUPLINGS for beam in ("static", "dynamic")]
BENT = ChargeCoupling(gain_1=90e-9, time_1=5.0, odd=-0.05, even=0.02)


def line(actuator: Actuator, sheet: float, **electrodes: Any) -> Actuator:
    return replace(actuator, electrodes=Electrodes(sheet, sheet, **electrodes))


@pytest.mark.parametrize(("coupling", "beam"), CASES)
@pytest.mark.parametrize("model", ["rc", "cpe"])
def test_without_sheet_resistance_it_is_the_lumped_strip(coupling: str, beam: str, model: str) -> None:
    lumped = strip(coupling, model)
    lump = transient(strip_netlist(lumped, beam=beam), STEP, T, engine="exact")
    found = transient(strip_netlist(line(lumped, 0.0, cells=3), beam=beam), STEP, T, engine="exact")
    for k, name in enumerate(lump.names[:3]):
        # the reflection of a fractional law of voltage has time constants down to 1e-8 s: rounding, as stated
        bound = found.errors[0, k] if (coupling, beam, model) == ("voltage fractional", "dynamic", "rc") else 1e-9
        assert np.abs(found.output(name) - lump.output(name)).max() <= bound * np.abs(lump.output(name)).max()
    if beam == "static":
        curvature = 2 * lump.output("displacement") / 30e-3**2
        for k in (1, 2, 3):
            assert found.output(f"curvature_{k}") == pytest.approx(curvature, rel=1e-9, abs=1e-9 * abs(curvature).max())


@pytest.mark.parametrize("beam", ["static", "dynamic"])
def test_odd_and_even_parts_too(beam: str) -> None:
    lump, found = (
        ilg.simulate(each, "step:4V", "20 s", beam=beam, samples=21)
        for each in (strip(BENT), line(strip(BENT), 0.0, cells=2))
    )
    assert found.displacement == pytest.approx(lump.displacement, abs=2e-6 * abs(lump.displacement).max())


@pytest.mark.parametrize("law", [ChargeCoupling(**TWO), BENT], ids=["linear", "bent"])
def test_two_cells_against_an_ode_of_their_charges(law: ChargeCoupling) -> None:
    """Two cells of 15 mm, contact at the inner end: 4 V drives the first, and through it the second."""
    sheet = 40.0
    actuator = line(strip(law), sheet, cells=2, contact="end")
    actuator = replace(actuator, geometry=replace(actuator.geometry, length=30e-3))
    lumped = lumped_elements(actuator)
    ((rd, c),) = lumped.port.branches
    rd, c, rdc = 2 * rd, c / 2, 2 * lumped.port.dc_resistance  # of half the strip
    loop = 2 * sheet / 5e-3 * 15e-3  # both sheets over the length of a cell
    gains, taus = (np.array([getattr(r, key) for r in law.relaxations]) for key in ("gain", "time"))

    def voltages(q: np.ndarray) -> np.ndarray:
        # of each cell: current from the source through half a cell, then a whole one
        a = np.array([[1 / (loop / 2) + 1 / loop, -1 / loop], [-1 / loop, 1 / loop]]) + np.eye(2) * (1 / rd + 1 / rdc)
        return np.linalg.solve(a, np.array([4.0 / (loop / 2), 0.0]) + q / c / rd)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, z = y[:2], y[2:].reshape(2, -1)
        x = q / c
        w = x + (law.odd or 0.0) * x * np.abs(x) + (law.even or 0.0) * x * x
        return np.concatenate([(voltages(q) - x) / rd, ((w[:, None] - z) / taus).ravel()])

    start = np.zeros(2 + 2 * len(taus))
    found = solve_ivp(rates, (0, T[-1]), start, method="Radau", rtol=1e-10, atol=1e-13, t_eval=T)
    curvatures = 6 / actuator.geometry.thickness**2 * found.y[2:].reshape(2, len(taus), -1).transpose(0, 2, 1) @ gains
    run = ilg.simulate(actuator, "step:4V", times=T, beam="static", engine="exact" if law.linear else "ngspice")
    assert run.curvatures is not None
    assert np.abs(run.curvatures.values.T - curvatures).max() <= 1e-6 * np.abs(curvatures).max()
    assert curvatures[0, 2] > 1.3 * curvatures[1, 2]  # the base bends first


@with_ngspice
def test_deck_and_library_of_a_strip_that_bends_by_charge(tmp_path: Path) -> None:
    actuator = line(strip("charge fractional"), 5.0, cells=3)
    run = ilg.simulate(actuator, "step:4V", "30 s", samples=31, beam="static", engine="exact")
    assert run.curvatures is not None
    (tmp_path / "strip.lib").write_text(ilg.library(actuator))
    deck = (
        "charge\n.include strip.lib\nV1 p1 0 pwl(0 0 1e-7 4)\nX1 p1 0 ilg_strip_1\n"
        ".options reltol=1e-7 abstol=1e-12 vntol=1e-12\n.tran 0.01 30 0 0.01 uic\n.control\nset numdgt=12\n"
        "set wr_singlescale\nset wr_vecnames\nrun\nwrdata run.txt v(x1.k1) v(x1.k3)\nquit 0\n.endc\n.end\n"
    )
    (tmp_path / "run.cir").write_text(deck)
    ngspice(tmp_path, "run.cir")
    found = table(tmp_path / "run.txt")
    for column, k in (("v(x1.k1)", 0), ("v(x1.k3)", 2)):
        expected = run.curvatures.values[1:, k]
        assert np.interp(run.time[1:], found["time"], found[column]) == pytest.approx(expected, rel=1e-4)


def test_what_a_dynamic_beam_cannot_have_is_said() -> None:
    law = ChargeCoupling(instantaneous=1e-9, odd=0.1)
    with pytest.raises(InputError, match="static"):
        strip_netlist(line(strip(law), 5.0, cells=2), beam="dynamic")

"""A moved strip: its terminals' answer over time, by both engines and from the port equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from every_model import PortEquations, strip_of, strongly_coupled

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.errors import InputError
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.simulation.sensing import sense
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

T = np.linspace(0, 60, 121)
MOTIONS = ["step:1mm", "sine:1mm,0.1Hz", "square:-1mm..1mm,20s", "ramp:0.1mm/s"]


@pytest.mark.parametrize("terminals", ["open", "short"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_engines_agree(motion: str, terminals: str) -> None:
    strip = strongly_coupled(strip_of("rc2", 5.0))
    source = parse_drive(motion, 60.0, "m")
    found, exact = (sense(strip, source, T, terminals=terminals, engine=e) for e in ("ngspice", "exact"))
    for name in ("voltage", "current", "charge", "force", "displacement"):
        expected = getattr(exact, name)
        assert getattr(found, name) == pytest.approx(expected, abs=1e-7 * np.abs(expected).max()), name
    silent = found.current if terminals == "open" else found.voltage
    assert not silent.any()
    assert found.displacement == pytest.approx(source.value(T), abs=1e-15)


@pytest.mark.parametrize(
    ("model", "terminals"), [("rc", "open"), ("rc", "short"), ("rc+sinh", "short"), ("rc2+growing", "short")]
)
def test_a_long_sine_ends_in_its_phasor(model: str, terminals: str) -> None:
    """Also where the laws are nonlinear: at nanovolts they are straight."""
    assert PAPER.coupling is not None
    base = replace(PAPER, coupling=replace(PAPER.coupling, natural_frequency=0.5))
    strip = strip_of(model, 0.0 if terminals == "open" else 5.0, base)
    # nothing of the start is left after so many time constants
    end = 3000.0 if terminals == "open" else 500.0
    t = np.linspace(end - 10, end, 21)
    found = sense(strip, parse_drive("sine:1mm,0.1Hz", end, "m"), t, terminals=terminals)
    s = np.array([0.2j * np.pi])
    phasor = PortEquations(strip, lumped_elements(strip).port, s).moved(terminals)
    name = "voltage" if terminals == "open" else "current"
    expected = np.imag(1e-3 * phasor[name][0] * np.exp(s[0] * t))
    assert getattr(found, name) == pytest.approx(expected, abs=2e-5 * np.abs(expected).max())


def test_a_ladder_s_fast_modes_do_not_spoil_a_long_run() -> None:
    """Their time constants are 1e-13 of it: a first step that short would not move ngspice's time."""
    strip = strip_of("warburg", 5.0)
    source, t = parse_drive("ramp:1um/s", 3000.0, "m"), np.linspace(0, 3000.0, 4)
    found, exact = (
        sense(strip, source, t, terminals="short", engine=e, accuracy=1e-6).charge for e in ("ngspice", "exact")
    )
    assert found == pytest.approx(exact, abs=1e-6 * np.abs(exact).max())


def test_what_a_strip_makes_it_also_senses() -> None:
    """Reciprocity over time: charge through the short per metre is clamped force per volt, sign and all."""
    strip = strongly_coupled(PAPER)
    found = sense(strip, parse_drive("step:1mm", 60.0, "m"), T, terminals="short")
    driven = simulate(strip, parse_drive("step:1V", 60.0), T, tip="clamped")
    assert found.charge / 1e-3 == pytest.approx(driven.force, abs=1e-8 * driven.force.max())


def test_the_force_is_that_of_the_spring() -> None:
    found = sense(PAPER, parse_drive("ramp:0.1mm/s", 60.0, "m"), T)
    stiffness = lumped_elements(PAPER).stiffness
    assert found.force == pytest.approx(-stiffness * found.displacement, rel=1e-6, abs=1e-16)
    assert "voltage" in found.summary()


def test_a_file_moves_too(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("time_s,displacement_mm\n0,0\n5,1\n60,-1\n")
    found = sense(PAPER, parse_drive(f"file:{tmp_path / 'm.csv'}", 60.0, "m"), T)
    assert found.displacement == pytest.approx(np.interp(T, [0, 5, 60], [0, 1e-3, -1e-3]), abs=1e-18)
    found.write_csv(tmp_path / "s.csv")
    header, *rows = (tmp_path / "s.csv").read_text().splitlines()
    assert header == "time_s,displacement_m,voltage_V,current_A,force_N,charge_C"
    table = np.array([[float(x) for x in row.split(",")] for row in rows])
    for k, name in enumerate(("time", "displacement", "voltage", "current", "force", "charge")):
        assert (table[:, k] == getattr(found, name)).all(), "not to the last digit"


def test_refused() -> None:
    motion = parse_drive("step:1mm", 1.0, "m")
    with pytest.raises(InputError, match=r"has no \[coupling\]; it cannot sense"):
        sense(replace(PAPER, coupling=None), motion, [0.0, 1.0])
    with pytest.raises(InputError, match="terminals are 'loose'; choose open or short"):
        sense(PAPER, motion, [0.0, 1.0], terminals="loose")
    for text in ("step:1V", "sine:1mm,1s", "ramp:1V/s", "square:1mm,1Hz"):
        with pytest.raises(InputError, match="does not measure this quantity"):
            parse_drive(text, 1.0, "m")
    with pytest.raises(InputError, match="write one of step:1mm"):
        parse_drive("triangle:1mm", 1.0, "m")
    assert strip_netlist(PAPER).linear

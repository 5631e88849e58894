"""Every model of the registry: named, described, simulated, fitted, exported, kept in a file."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from every_model import MODELS, VALUES, port_of, strip_of, values_of
from synthetic import fit_current

from ilg_circuit.circuit import port_netlist, strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.measurements.record import Channel, Record
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate, transient_band
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.describe import describe
from ilg_circuit.strip.elements import electrical_model_of, lumped_elements
from ilg_circuit.strip.file import dumps, loads
from ilg_circuit.strip.models import electrical_model, model_names


@pytest.mark.parametrize("model", MODELS)
def test_a_model_describes_its_parameters(model: str) -> None:
    kind = electrical_model(model)
    assert kind.name == model
    assert len(set(kind.names)) == len(kind.names)
    assert kind.names[0] == "dc_resistance"
    units = {"resistance": "ohm", "capacitance": "F", "time": "s", "voltage": "V", "slope": "1/V", "exponent": ""}
    units |= {"inductance": "H"}
    limits = {"cpe_exponent": 1.0, "interface_exponent": 1.0, "diffusion_exponent": 0.5}
    for p in kind.parameters:
        word = p.name.rstrip("_0123456789").rsplit("_", 1)[-1]
        assert p.unit == units.get(word, "F s^(a-1)")
        assert p.meaning
        assert (p.lower, p.upper) == (0.0, limits.get(p.name, np.inf))
    assert kind.linear == (not {"sinh", "growing"} & set(model.split("+")))
    assert kind.port(values_of(model)).linear == kind.linear


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_values_out_of_limits_are_named(model: str, bad: float) -> None:
    kind = electrical_model(model)
    for k, name in enumerate(kind.names):
        values = values_of(model)
        values[k] = bad
        with pytest.raises(InputError, match=f"{name} is .* it must be more than zero"):
            kind.port(values)
    with pytest.raises(InputError, match=f"takes {len(kind.names)} values"):
        kind.port(values_of(model)[:-1])


@pytest.mark.parametrize(
    "name", ["", "rc4", "RC", "rc+", "+sinh", "rc+diode", "rc+sinh+sinh", "warburg+growing", "cpe+sinh+growing"]
)
def test_models_that_there_are_not(name: str) -> None:
    with pytest.raises(InputError, match="model is '"):
        electrical_model(name)


def test_the_order_of_additions_does_not_matter() -> None:
    assert electrical_model("rc2+sinh+growing") is electrical_model("rc2+growing+sinh")
    assert len(set(model_names())) == len(model_names()) == 6 + 6 + 3 + 6


@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_a_strip_keeps_its_port_through_a_file(model: str, electrodes: float) -> None:
    strip = strip_of(model, electrodes)
    again = loads(dumps(strip))
    assert again == strip
    assert electrical_model_of(again).name == model
    s = 2j * np.pi * np.geomspace(1e-3, 1e3, 7)
    for bias in (0.0, 2.0):
        expected = port_of(model, electrodes).impedance(s, bias)
        assert lumped_elements(again).port.impedance(s, bias) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_show_names_every_parameter(model: str) -> None:
    told = describe(strip_of(model), band=(1e-3, 10.0))
    for name in electrical_model(model).names:
        assert told["elements"][name]["value"] == pytest.approx(VALUES[name], rel=1e-9), name
    json.dumps(told)


@pytest.mark.parametrize("model", [m for m in MODELS if m != "warburg+sinh"])
def test_every_model_is_simulated(model: str) -> None:
    """At rest: the electron path's current, and the charge that the law holds."""
    t = np.array([0.0, 1000.0, 4000.0])
    found = simulate(strip_of(model), parse_drive("step:2V", 4000.0), t)
    v = VALUES
    steady = v["emission_voltage"] / 600 * np.sinh(2 / v["emission_voltage"]) if "sinh" in model else 2 / 600
    port = port_of(model)
    if not model.startswith("cpe"):
        assert found.current[-1] == pytest.approx(steady, rel=1e-5)
        growth = 1 + v["capacitance_slope"] if "growing" in model else 1
        assert found.charge[-1] == pytest.approx(2 * port.capacitance * growth, rel=1e-5)
    else:  # a constant phase element's step current never ends: U Q t^-a/Gamma(1 - a)
        tail = 2 * v["cpe_coefficient"] * 4000**-0.75 / 3.6256099082
        assert found.current[-1] - steady == pytest.approx(tail, rel=0.02)


# -- fitted ------------------------------------------------------------------------------------------------------------

#: Several levels of both signs: the laws of voltage need them.
STAIRS = PiecewiseLinear([0, 40, 40, 80, 80, 120, 120, 160], [1.0, 1, 3, 3, -2, -2, 2, 2], "stairs")


@pytest.mark.parametrize("model", ["rc", "rc2", "rc3", "warburg", "cpe", "rc+sinh", "rc+growing"])
def test_every_fit_finds_the_truth(model: str) -> None:
    t = np.linspace(0.5, 159.5, 160)
    net = port_netlist(port_of(model, 2.0, band=transient_band(t)))
    true = transient(net, STAIRS, t, accuracy=1e-6, acceptable=1e-5).output("current")
    noise = 2e-4 * np.abs(true).max() * np.random.default_rng(5).standard_normal(len(t))
    measured = Record("made up", 0.0, STAIRS, None, Channel(t, true + noise), None)
    found = fit_current(measured, model, 2.0)
    assert found.fit.labels == electrical_model(model).names
    assert (np.abs(found.fit.values - values_of(model)) <= 4 * found.fit.errors).all()
    assert found.fit.rmse == pytest.approx(noise.std(), rel=0.1)
    assert (found.fit.errors < 0.05 * found.fit.values).all()
    assert found.port.electrode_resistance == 2.0


# -- exported ----------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("ngspice") is None, reason="plain ngspice is not installed")
@pytest.mark.parametrize("model", ["rc2", "rc3"])
def test_a_deck_runs_by_plain_ngspice(model: str, tmp_path: Path) -> None:
    strip = strip_of(model, 5.0, band=(1e-3, 10.0), sections=8)
    drive = parse_drive("step:2V", 30.0)
    (tmp_path / "a.cir").write_text(deck(strip_netlist(strip), drive, 30.0, strip, samples=31))
    ran = subprocess.run(
        ["ngspice", "-b", "a.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
    )
    rows = [line.split() for line in ran.stdout.splitlines() if line[:1].isdigit()]
    table = np.array([[float(x) for x in row] for row in rows if len(row) >= 4])
    assert len(table) > 10, ran.stderr
    t, current = table[:, 1], table[:, 3]
    late = t > 1e-3
    expected = simulate(strip, drive, np.unique(t[late]), engine="exact").current
    assert np.interp(np.unique(t[late]), t, current) == pytest.approx(expected, rel=1e-4)


def test_the_paper_s_strip_is_of_the_simplest_model() -> None:
    assert electrical_model_of(PAPER).name == "rc"

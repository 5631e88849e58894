"""Every model of the registry: named, described, simulated, fitted, exported, kept in a file."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from math import gamma
from pathlib import Path

import numpy as np
import pytest
from every_model import MODELS, VALUES, port_of, strip_of, values_of
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import log_floats
from synthetic import fit_current

from ilg_circuit.circuit import port_netlist, strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.identification.impedance import ImpedanceData
from ilg_circuit.identification.port_fit import fit_port
from ilg_circuit.measurements.record import Channel, Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.measurements.voltage import MeasuredDrive
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import simulate, transient_band
from ilg_circuit.solve import transient
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.describe import describe
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import dumps, loads
from ilg_circuit.strip.models import Ladders, candidates, electrical_model, model_names
from ilg_circuit.strip.models.cpe import cpe_impedance
from ilg_circuit.strip.models.warburg import warburg_impedance


@pytest.mark.parametrize("model", MODELS)
def test_a_model_describes_its_parameters(model: str) -> None:
    kind = electrical_model(model)
    assert kind.name == model
    assert len(set(kind.names)) == len(kind.names)
    assert kind.names[0] == "dc_resistance"
    units = {"resistance": "ohm", "capacitance": "F", "time": "s", "voltage": "V", "slope": "1/V", "exponent": ""}
    units |= {"inductance": "H", "fraction": ""}
    limits = {"cpe_exponent": 1.0, "interface_exponent": 1.0, "diffusion_exponent": 0.5, "packing_fraction": 1.0}
    for p in kind.parameters:
        word = p.name.rstrip("_0123456789").rsplit("_", 1)[-1]
        assert p.unit == units.get(word, "F s^(a-1)")
        assert p.meaning
        assert (p.lower, p.upper) == (0.0, limits.get(p.name, np.inf))
    assert kind.linear == (not {"sinh", "growing", "saturating", "steric"} & set(model.split("+")))
    assert kind.port(values_of(model)).linear == kind.linear


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_values_out_of_limits_are_named(model: str, bad: float) -> None:
    kind = electrical_model(model)
    for k, name in enumerate(kind.names):
        values = values_of(model)
        values[k] = bad
        if name == "capacitance_slope" and bad == -1.0:
            assert kind.port(values).capacitance_slope == bad  # of either sign
            continue
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
    assert len(set(model_names())) == len(model_names()) == 6 + 6 + 3 + 6 + 3 + 3


@pytest.mark.parametrize("electrodes", [0.0, 5.0])
@pytest.mark.parametrize("model", MODELS)
def test_a_strip_keeps_its_port_through_a_file(model: str, electrodes: float) -> None:
    strip = strip_of(model, electrodes)
    again = loads(dumps(strip))
    assert again == strip
    assert again.material.model.name == model
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
    # a constant phase element's step current never ends, nor that of diffusion with a < 1/2, late 1/(Q s^2a)
    endless = {
        "cpe": (v["cpe_coefficient"], v["cpe_exponent"]),
        "randles": (20 ** (2 * v["diffusion_exponent"]) / v["warburg_resistance"], 2 * v["diffusion_exponent"]),
    }
    if model.split("+")[0] not in endless:
        assert found.current[-1] == pytest.approx(steady, rel=1e-5)
        growth = 1 + v["capacitance_slope"] if "growing" in model else 1
        growth = 1.5 * np.tanh(2 / 3) if "saturating" in model else growth
        if "steric" in model:  # q = q0 sqrt((2/nu) ln(1 + 2 nu sinh^2(v/(4 VT)))), q0 = 2 C VT
            vt, nu = 0.025692579, v["packing_fraction"]
            growth = vt * np.sqrt(2 / nu * np.log(1 + 2 * nu * np.sinh(2 / (4 * vt)) ** 2))
        assert found.charge[-1] == pytest.approx(2 * port.capacitance * growth, rel=1e-5)
    else:
        q, exponent = endless[model.split("+")[0]]
        tail = 2 * q * 4000**-exponent / gamma(1 - exponent)
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
    measured = Record("made up", 0.0, MeasuredDrive(STAIRS, np.zeros(1)), None, Channel(t, true + noise), None)
    found = fit_current(measured, model, 2.0)
    assert found.fit.labels == electrical_model(model).names
    assert (np.abs(found.fit.values - values_of(model)) <= 4 * found.fit.errors).all()
    assert found.fit.rmse == pytest.approx(noise.std(), rel=0.1)
    assert (found.fit.errors < 0.05 * found.fit.values).all()
    assert found.port.electrode_resistance == 2.0


@pytest.mark.parametrize("model", [m for m in MODELS if electrical_model(m).linear])
def test_a_fit_to_a_clean_spectrum_gives_back_what_went_in(model: str) -> None:
    kind, f = electrical_model(model), np.geomspace(1e-3, 1e3, 40)
    z = kind.impedance(np.array([values_of(model)]), 2j * np.pi * f, 2.0)[0]
    found = fit_port((ImpedanceData.of(Spectrum("made up", f, z)),), model, 2.0)
    assert list(found.values.values()) == pytest.approx(values_of(model), rel=1e-5)


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
    assert PAPER.material.model.name == "rc"


# -- what a fit asks of a model ----------------------------------------------------------------------------------------

S = 2j * np.pi * np.geomspace(1e-3, 1e3, 25)


@pytest.mark.parametrize("model", MODELS)
def test_many_sets_at_once_are_the_port(model: str) -> None:
    kind = electrical_model(model)
    sets = np.array(values_of(model)) * np.random.default_rng(1).uniform(0.6, 1.08, (4, len(kind.names)))
    expected = np.array([kind.port(v.tolist(), 5.0).impedance(S, ideal=True) for v in sets])
    assert kind.impedance(sets, S, 5.0) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("model", MODELS)
def test_order_puts_interchangeable_parts_by_time_constant(model: str) -> None:
    kind, values = electrical_model(model), np.array(values_of(model))
    index = kind.order(values)
    assert sorted(index) == list(range(len(values)))
    assert (kind.order(values[index]) == np.arange(len(values))).all()
    pairs = kind.pairs(values[index].tolist())
    assert sorted(pairs, key=lambda pair: pair[0] * pair[1]) == pairs
    if model.startswith(("rc2", "rc3")):
        swapped = values.copy()
        swapped[1:3], swapped[3:5] = values[3:5], values[1:3]
        assert swapped[kind.order(swapped)] == pytest.approx(values)
    else:
        assert (index == np.arange(len(values))).all()


@pytest.mark.parametrize("model", MODELS)
def test_starting_values_are_allowed_values(model: str) -> None:
    kind = electrical_model(model)
    pairs = [(10.0 * k, 0.1 * k) for k in range(1, kind.ions.branch_counts[0] + 1)]
    assert kind.port(kind.starts_from_branches(500.0, pairs, 3.0).tolist())
    z = kind.impedance(np.array([values_of(model)]), S)[0]
    if kind.linear:
        sets = kind.spectrum_starts(z, S.imag, np.random.default_rng(2))
        assert sets.shape == (60, len(kind.names))
        assert all(kind.port(v.tolist(), ladders=Ladders(sections=4)) for v in sets[::20])
    else:
        with pytest.raises(InputError, match="does not show"):
            kind.spectrum_starts(z, S.imag, np.random.default_rng(2))
    for found in kind.pooled_starts(pairs):
        assert set(found) <= set(kind.names)


@pytest.mark.parametrize("model", MODELS)
def test_ladders_of_a_fit_differ_in_their_values_only(model: str) -> None:
    kind, values = electrical_model(model), np.array(values_of(model))
    ladders = kind.ladders(values, (1e-3, 10.0))
    counts = {len(port_netlist(kind.port(v.tolist(), 0.0, ladders)).elements) for v in (values, 0.8 * values)}
    assert len(counts) == 1


def test_what_a_model_says_of_voltages_and_data() -> None:
    kind = electrical_model("rc2+growing+sinh")
    assert (kind.plain, kind.ions.name, [a.name for a in kind.additions]) == ("rc2", "rc2", ["growing", "sinh"])
    assert kind.needs_several_voltages == ("capacitance_slope", "emission_voltage")
    assert kind.constant_voltage_hides == ("emission_voltage",)
    assert electrical_model("randles+inductance").spectra_only == ("inductance",)
    assert electrical_model("randles+inductance").needs_several_voltages == ()
    assert candidates("record") == ("rc", "rc2", "rc3", "warburg")
    assert candidates("spectrum") == ("rc", "rc2", "rc3", "warburg", "cpe")


def test_quantities_that_follow_from_a_fit() -> None:
    assert electrical_model("rc").derived([600, 20, 0.35]) == {"time_constant": (7.0, "s")}
    two = electrical_model("rc2+sinh").derived([600, 30, 0.1, 50, 0.3, 0.8])
    assert two == {"time_constant_1": (3.0, "s"), "time_constant_2": (15.0, "s"), "total_capacitance": (0.4, "F")}
    assert electrical_model("warburg").derived([600, 15, 60, 30]) == {"diffusion_capacitance": (0.5, "F")}
    found = electrical_model("randles").derived([600, 15, 2.0, 0.25, 0.5, 60, 30, 0.45])
    assert found == {"interface_coefficient": (0.25, "F s^(a-1)"), "diffusion_capacitance": (0.5, "F")}


@pytest.mark.parametrize("model", MODELS)
def test_both_ends_of_a_port(model: str) -> None:
    kind = electrical_model(model)
    port = replace(kind.port(values_of(model), 5.0), inductance=0.0)
    assert port.steady_resistance == pytest.approx(port.impedance(1e-14j, ideal=True).real, rel=1e-6)
    assert port.high_frequency_resistance == pytest.approx(port.impedance(1e16j, ideal=True).real, rel=1e-3)


# -- randles -----------------------------------------------------------------------------------------------------------


def test_randles_with_an_exponent_of_one_half_is_a_warburg_element_behind_an_arc() -> None:
    z = electrical_model("randles").impedance(np.array([[1e30, 15.0, 12.0, 0.3, 0.8, 60.0, 20.0, 0.5]]), S)[0]
    arc = 1 / (1 / 12 + cpe_impedance(S, 0.3**0.8 / 12, 0.8) ** -1)
    assert z == pytest.approx(15 + arc + warburg_impedance(S, 60.0, 20.0), rel=1e-12)


@settings(max_examples=25)
@given(
    st.floats(0.3, 0.99), st.floats(0.3, 0.499), log_floats(1e-4, 1e2), log_floats(1e-1, 1e4), log_floats(1e-5, 1e-1),
    st.floats(2.0, 8.0),
)  # fmt: skip
def test_the_ladder_of_randles_is_within_its_stated_error(
    alpha: float, a: float, fast: float, slow: float, low: float, decades: float
) -> None:
    kind = electrical_model("randles")
    values, band = [600.0, 15.0, 12.0, fast, alpha, 60.0, slow, a], (low, low * 10**decades)
    port = kind.port(values, ladders=Ladders(band))
    assert port.ladder is not None
    assert port.ladder.error < 2e-4
    assert all(r > 0 and c > 0 for r, c in port.ladder.sections)
    s = 2j * np.pi * np.exp(np.random.default_rng(1).uniform(*np.log(band), 100))
    ideal = kind.impedance(np.array([values]), s)[0]
    assert np.abs(port.impedance(s) / ideal - 1).max() <= port.ladder.error


def test_the_ladder_of_randles_states_its_error_beside_the_warburg_element() -> None:
    """Its relaxations become narrow towards an exponent of one half: the most sections leave 4e-4."""
    kind, band = electrical_model("randles"), (0.1, 10.0)
    values = [600.0, 15.0, 12.0, 1.0, 0.5, 60.0, 1.0, 0.4999]
    port = kind.port(values, ladders=Ladders(band))
    assert port.ladder is not None
    assert port.ladder.error < 5e-4
    s = 2j * np.pi * np.geomspace(*band, 100)
    ideal = kind.impedance(np.array([values]), s)[0]
    assert np.abs(port.impedance(s) / ideal - 1).max() <= port.ladder.error


def test_the_ladder_of_randles_is_a_smooth_function_of_its_constants() -> None:
    """A fit takes derivatives of it by differences."""
    kind, s = electrical_model("randles"), np.array([1j])
    for k in range(2, 8):
        found = []
        for step in np.linspace(-0.02, 0.02, 41):
            values = np.array([600.0, 15.0, 12.0, 0.3, 0.8, 60.0, 20.0, 0.46])
            values[k] *= np.exp(step)
            port = kind.port(values.tolist(), ladders=Ladders((1e-3, 10.0), 24))
            found.append(port.impedance(s)[0])
        bends = np.abs(np.diff(found, 3))
        assert bends.max() < 1e-5 * np.abs(np.diff(found)).max() + 1e-12, kind.names[k]

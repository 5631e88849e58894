"""Circuits and models of a user's own, through the front door."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

import ilg_circuit as ilg
from ilg_circuit.strip.file import load_actuator, save_actuator
from ilg_circuit.strip.models import MODELS


def test_a_strip_in_a_circuit_of_ones_own() -> None:
    """Behind a resistor in a PySpice circuit the current is that of the strip with so much more Re."""
    from PySpice.Spice.Netlist import Circuit

    circuit = Circuit("driver")
    circuit.subcircuit(ilg.subcircuit("paper"))
    circuit.V("supply", "in", circuit.gnd, "PWL(0 0 1e-6 4 1000 4)")
    circuit.R("out", "in", "plus", 10)
    circuit.X("strip", "ilg_strip", "plus", circuit.gnd, circuit.gnd)
    simulator = circuit.simulator(temperature=27, nominal_temperature=27)
    simulator.options(reltol=1e-7, abstol=1e-12)
    found = simulator.transient(step_time=0.05, end_time=20, max_time=0.02, use_initial_condition=True)
    later = np.array(found.time) > 1e-2
    current, time = -np.array(found["Vsupply"])[later], np.array(found.time)[later]
    area = ilg.PAPER.geometry.length * ilg.PAPER.geometry.width
    leads = {"electrode_resistivity_1": 10 * area / 1e-6, "electrode_thickness_1": 1e-6}
    behind = replace(ilg.PAPER, material=replace(ilg.PAPER.material, **leads))
    wanted = ilg.simulate(behind, "step:4V", engine="exact", times=np.append(0.0, time))
    assert_allclose(current, wanted.current[1:], rtol=1e-4)


BOTH = """
import numpy as np, ilg_circuit as ilg
from PySpice.Spice.Netlist import Circuit

def own():
    circuit = Circuit("driver")
    circuit.subcircuit(ilg.subcircuit("paper"))
    circuit.V("supply", "in", circuit.gnd, "PWL(0 0 1e-6 4 1000 4)")
    circuit.X("strip", "ilg_strip", "in", circuit.gnd, circuit.gnd)
    found = circuit.simulator().transient(step_time=0.1, end_time=20, use_initial_condition=True)
    return -float(np.array(found["Vsupply"])[-1])

def package():
    return float(ilg.simulate("paper", "step:4V", "20 s").current[-1])

print([f() for f in (%s)])
"""


@pytest.mark.parametrize("order", ["own, package, own, package", "package, own, package, own"])
def test_a_users_simulator_and_ours_take_turns(order: str) -> None:
    done = subprocess.run([sys.executable, "-c", BOTH % order], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    currents = eval(done.stdout.splitlines()[-1])
    assert currents == pytest.approx([currents[0]] * 4, rel=2e-3)


def test_subcircuits_of_every_model_have_their_pins() -> None:
    assert ilg.subcircuit("paper").external_nodes == ("plus", "minus", "tip")


@pytest.fixture
def gerischer() -> Iterator[str]:
    def element(s: Any, resistance: Any, time: Any, capacitance: Any) -> Any:
        return resistance / np.sqrt(1 + s * time) + 1 / (capacitance * s)

    typical = {"reaction_resistance": "50 ohm", "reaction_time": "2000 ms", "reaction_capacitance": "300 mF"}
    yield ilg.register_model("gerischer", element, typical).name
    MODELS.pop("gerischer", None)


def impedance(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    s = 2j * np.pi * frequency
    ions = 15 + 40 / np.sqrt(1 + 5 * s) + 1 / (0.4 * s)
    return np.asarray(1 / (1 / 700 + 1 / ions))


def test_a_model_of_ones_own_is_fitted_and_kept(gerischer: str, tmp_path: Path) -> None:
    f = np.geomspace(1e-3, 1e3, 40)
    fit = ilg.identify(frequency=f, impedance=impedance(f), model=gerischer)
    values = {name: p.value for name, p in fit.parameters.items() if p.value}
    assert values["dc_resistance"] == pytest.approx(700, rel=1e-5)
    assert values["series_resistance"] == pytest.approx(15, rel=1e-5)
    assert values["reaction_resistance"] == pytest.approx(40, rel=1e-5)
    assert values["reaction_time"] == pytest.approx(5, rel=1e-5)
    assert values["reaction_capacitance"] == pytest.approx(0.4, rel=1e-5)
    save_actuator(fit.actuator, tmp_path / "fitted.toml")
    assert load_actuator(tmp_path / "fitted.toml").material.model.name == gerischer
    spectrum = ilg.impedance(tmp_path / "fitted.toml", frequency=f[10:30], engine="exact", beam="static")
    assert spectrum.ladder is not None
    assert spectrum.ladder.error < 0.03
    assert_allclose(spectrum.impedance, impedance(f[10:30]), rtol=spectrum.ladder.error)


def test_constants_without_a_capacitance() -> None:
    def arc(s: Any, resistance: Any, time: Any) -> Any:
        return resistance / np.sqrt(s * time) / np.tanh(np.sqrt(s * time))

    try:
        model = ilg.register_model("slow", arc, {"slow_resistance": "50 ohm", "slow_time": "8 s"})
        values = (10.0, 50.0, 8.0)
        assert model.from_material(model.to_material(values)) == pytest.approx(values)
        assert {p.name for p in model.material} == {"slow_time"}
        assert model.stores
    finally:
        MODELS.pop("slow", None)


@pytest.mark.parametrize(
    ("constants", "function", "hint"),
    [
        ({"a": "50 ohm"}, lambda s, a: a + 0 * s, "needs a constant in F, or one in ohm and one in s"),
        ({"a": "50 V"}, lambda s, a: a, "a is in 'V'; constants are in ohm, F, s, Hz or numbers"),
        ({"a": "0 F"}, lambda s, a: 1 / (a * s), "a is typically 0"),
        ({"a": "1 F"}, lambda s: 1 / s, "its impedance fails at typical values"),
        ({"a": "1 F"}, lambda s, a: 1.0, "must return one finite number for every s"),
        ({"a": "1 F"}, lambda s, a: -1 / (a * s) - 5, "a real part of zero or more"),
    ],
)
def test_models_that_cannot_be(constants: dict[str, str], function: Any, hint: str) -> None:
    with pytest.raises(ilg.InputError) as raised:
        ilg.register_model("impossible", function, constants)
    assert hint in str(raised.value)
    assert "impossible" not in MODELS


def test_a_model_that_is_there_already() -> None:
    with pytest.raises(ilg.InputError, match="model 'rc2' cannot be registered"):
        ilg.register_model("rc2", lambda s, c: 1 / (c * s), {"c": "1 F"})
    with pytest.raises(ilg.InputError, match="upper names 'b', which is not one of its constants"):
        ilg.register_model("new", lambda s, c: 1 / (c * s), {"c": "1 F"}, upper={"b": 1})


def test_ones_own_model_is_replaced_when_that_is_said() -> None:
    """An arc stores nothing at rest, so that nothing is said of its capacitance."""

    def arc(s: Any, resistance: Any, time: Any) -> Any:
        return resistance / (1 + s * time)

    typical = {"arc_resistance": "40 ohm", "arc_time": "2 s"}
    try:
        ilg.register_model("arc", lambda s, r, time: 2 * r / (1 + s * time), typical)
        with pytest.raises(ilg.InputError, match="registered already: replace=True puts this one in its place"):
            ilg.register_model("arc", arc, typical)
        with pytest.raises(ilg.InputError, match="'rc2' cannot be registered"):
            ilg.register_model("rc2", arc, typical, replace=True)
        assert not ilg.register_model("arc", arc, typical, replace=True).stores
        f = np.geomspace(1e-3, 1e3, 30)
        noise = 1 + 1e-3 * np.random.default_rng(0).standard_normal(len(f))
        z = 3 + noise / (1 / 600 + 1 / (20 + arc(2j * np.pi * f, 40, 2)))
        fit = ilg.identify(frequency=f, impedance=z, strip="paper", model="arc")
        assert fit.parameters["arc_time"].value > 0
        assert "port-out-of-proportion" not in {finding.code for finding in fit.findings}
        with pytest.raises(ilg.InputError, match=r"unknown parameter 'Rd'; known are dc_resistance, "):
            fit.parameters["Rd"]
        assert fit.parameters.get("Rd") is None
    finally:
        MODELS.pop("arc", None)

"""The registry: models of other packages work in every command, and what cannot be registered is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from command import Run
from numpy.testing import assert_allclose

from ilg_circuit.circuit.strip import port_netlist
from ilg_circuit.errors import InputError
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.identification.impedance import ImpedanceData
from ilg_circuit.identification.port_fit import fit_port
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.impedance import impedance
from ilg_circuit.simulation.response import simulate
from ilg_circuit.solve.spectrum import spectrum
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.file import dumps, load_actuator, loads, save_actuator
from ilg_circuit.strip.models import (
    MODELS,
    Ladders,
    candidates,
    electrical_model,
    model_names,
    register,
    registry,
)
from ilg_circuit.strip.models.warburg import Warburg

#: A model as another package has it: a capacitor with a flattened arc before it.
TOY = """
import numpy as np
from ilg_circuit.fit.parameter import Parameter
from ilg_circuit.strip.models import LadderPath

class Arc(LadderPath):
    name = "toy"
    title = "capacitor behind an arc"
    equation = "Z = Re + Rdc || (Rs + R/(1 + (s T)^0.6) + 1/(C s))"
    constants = (
        Parameter("arc_resistance", "R", "ohm", "of the arc"),
        Parameter("arc_time", "T", "s", "of the arc"),
        Parameter("toy_capacitance", "C", "F", "behind it"),
    )
    material = (
        Parameter("arc_resistivity", "rho", "ohm m", "of the arc"),
        Parameter("arc_time", "T", "s", "of the arc"),
    )
    auto = ("spectrum",)
    below_band = True

    def element(self, values, s):
        r, t, c = values.T[:, :, None]
        return r / (1 + (s * t) ** 0.6) + 1 / (c * s)

    def to_material(self, values):
        return dict(zip(("dynamic_resistivity", "arc_resistivity", "arc_time", "permittivity"), values))

    def from_material(self, constants):
        return tuple(constants[k] for k in ("dynamic_resistivity", "arc_resistivity", "arc_time", "permittivity"))

    def starts_from_branches(self, pairs):
        (r, c), *_ = pairs
        return [r / 2, r / 2, r * c, c]

    def spectrum_starts(self, z, omega, random):
        n = 30
        size, times = np.abs(z).max() * 10 ** random.uniform(-3, 0.5, (n, 3)), random.uniform(-3, 3, n)
        return np.column_stack([30 * size[:, 0], size[:, 1], size[:, 2], 10**times, 10 ** random.uniform(-3, 1, n)])

arc = Arc()
"""

VALUES = [600.0, 15.0, 40.0, 20.0, 0.3]


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """An installed package with an entry point of the group of electrical models."""
    (tmp_path / "toy_package.py").write_text(TOY, encoding="utf-8")
    info = tmp_path / "toy_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: toy-package\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text("[ilg_circuit.models]\ntoy = toy_package:arc\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield "toy"
    MODELS.pop("toy", None)
    registry.loaded.discard("toy")


def toy_strip(model: str) -> Actuator:
    port = electrical_model(model).port(VALUES, 5.0, Ladders((1e-3, 100.0), 16))
    return Actuator.from_port(PAPER.geometry, port, base=PAPER.material, coupling=PAPER.coupling, name="made of toy")


def test_a_model_of_another_package_is_found_by_its_name(toy: str) -> None:
    assert toy in model_names()
    assert f"{toy}+sinh" in model_names()
    assert f"{toy}+growing" not in model_names()
    assert candidates("spectrum")[-1] == toy
    assert toy not in candidates("record")


def test_it_goes_through_a_file(toy: str) -> None:
    strip = toy_strip(toy)
    text = dumps(strip)
    assert 'arc_time = "20 s"' in text
    del MODELS[toy]  # as in another session, where nobody has named it
    registry.loaded.discard(toy)
    assert loads(text) == strip
    assert loads(text).material.model.name == toy


def test_its_ladder_its_netlist_and_its_closed_form_agree(toy: str) -> None:
    strip, f = toy_strip(toy), np.geomspace(1e-2, 50, 21)
    kind = electrical_model(toy)
    ideal = kind.impedance(np.array([VALUES]), 2j * np.pi * f, 5.0)[0]
    found = impedance(strip, f, beam="static")
    assert_allclose(found.impedance, ideal, rtol=1.1 * found.ladder.error)
    port = kind.port(VALUES, 5.0)
    assert port.ladder is not None
    assert port.ladder.error < 1e-4
    stamped = 1 / spectrum(port_netlist(port), f, engine="exact").output("current")
    assert_allclose(stamped, ideal, rtol=1.1e-4)


def test_it_is_simulated_and_its_energy_balances(toy: str) -> None:
    times = np.linspace(0.0, 60.0, 31)
    found = simulate(toy_strip(toy), parse_drive("square:-2V..3V,17s", 60.0), times, engine="exact")
    assert found.account.electrical_imbalance < 1e-6
    assert found.charge[-1] == pytest.approx(np.interp(60.0, found.time, found.charge))


def test_it_is_fitted_to_a_spectrum(toy: str) -> None:
    f = np.geomspace(1e-3, 1e3, 40)
    z = electrical_model(toy).impedance(np.array([VALUES]), 2j * np.pi * f)[0]
    found = fit_port((ImpedanceData.of(Spectrum("made up", f, z)),), toy, 0.0)
    assert list(found.values.values()) == pytest.approx(VALUES, rel=1e-6)


def test_every_command_knows_it(toy: str, run: Run, tmp_path: Path) -> None:
    save_actuator(toy_strip(toy), "toy.toml")
    assert "arc_resistance" in run("show", "toy.toml").out
    assert (
        "capacitor behind an arc as a ladder of " in run("impedance", "toy.toml", "--from", "10mHz", "--to", "10Hz").out
    )
    assert run("simulate", "toy.toml", "--drive", "step:1V", "--duration", "10s", "--engine", "exact").code == 0
    for name in ("toy.cir", "toy.lib"):
        assert run("netlist", "toy.toml", "--out", name).code == 0
        assert Path(name).stat().st_size > 1000
    assert load_actuator("toy.toml").material.constants[0][0] == "arc_resistivity"


def test_a_file_of_a_model_that_is_not_installed() -> None:
    text = dumps(PAPER).replace("youngs_modulus", 'arc_time = "1 s"\nyoungs_modulus')
    with pytest.raises(InputError, match=r"unknown key 'material\.arc_time'"):
        loads(text)


@pytest.mark.parametrize(
    ("attributes", "hint"),
    [
        ({"name": "rc2"}, "model 'rc2' cannot be registered"),
        ({"name": "a+b"}, "give a word that is not another model's name"),
        ({"name": "diffusing"}, "has the material keys of 'warburg'"),
        (
            {"name": "odd", "material": (Parameter("diffusion_time", "", "ohm m"),)},
            "has the material keys of 'warburg'",
        ),
        (
            {"name": "odd", "material": (Parameter("interface_time", "", "ohm m"),)},
            "material key interface_time is in s, not ohm m",
        ),
    ],
)
def test_what_cannot_be_registered(attributes: dict[str, object], hint: str) -> None:
    kind = type("Odd", (Warburg,), attributes)
    with pytest.raises(InputError, match=hint):
        register(kind())


@pytest.mark.parametrize(
    ("text", "hint"),
    [("toy_package:none", "cannot be loaded"), ("json:dumps", "is not an IonPath"), ("nowhere:x", "cannot be loaded")],
)
def test_entry_points_that_are_none(toy: str, tmp_path: Path, text: str, hint: str) -> None:
    file = tmp_path / "toy_package-1.0.dist-info" / "entry_points.txt"
    file.write_text(f"[ilg_circuit.models]\ntoy = {text}\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"electrical model 'toy' .*{hint}"):
        electrical_model("toy")

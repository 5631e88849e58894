"""The subcircuit handed out: its expressions are the strip's elements, and other engines get this package's answers."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from spice import LINEAR, MODELS, MOUNTED, elements, gnucap, ngspice, table, with_gnucap, with_ngspice

from ilg_circuit.circuit import strip_netlist
from ilg_circuit.circuit.deck import deck
from ilg_circuit.circuit.library import library, library_netlist, library_parameters
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import PAPER, Actuator, Geometry
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.models.cpe import cpe_impedance
from ilg_circuit.strip.models.warburg import warburg_impedance

Array = NDArray[np.float64]

DURATION = 60.0
STEP = PiecewiseLinear.step(4.0)
ALL = MODELS | MOUNTED
#: What transients are compared on: an inductance, which only spectra show, is a pole far beyond their steps.
TIMED = [name for name in ALL if "inductance" not in name]


def expected(strip: Actuator, times: Array, names: tuple[str, ...]) -> list[Array]:
    """This package's waveforms for a 4 V step, ten times better than they are compared to."""
    netlist = strip_netlist(strip)
    engine = "exact" if netlist.linear else "ngspice"
    waves = transient(netlist, STEP, times, engine=engine, accuracy=1e-7, interpolate=False)
    return [waves.output(name) for name in names]


def some(times: Array) -> NDArray[np.intp]:
    """Some hundred of a run's points, the first and the last among them: fast and slow parts alike."""
    return np.unique(np.linspace(0, len(times) - 1, 120).astype(int))


# -- text --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ALL)
def test_expressions_are_the_elements(which: str) -> None:
    strip = ALL[which]
    found = elements(library(strip))
    behavioural = []
    for element in library_netlist(strip).elements:
        if element.name == "Vdrive":
            continue
        if element.law:
            behavioural.append(element.name)
            continue
        *_, value = [word for word in found[element.name] if not word.startswith("ic=")]
        assert float(value) == pytest.approx(element.value, rel=1e-12), element.name
    assert len(behavioural) == len(re.findall("sinh|growing", which)) + ("rc2 growing" in which)


@pytest.mark.parametrize("which", ["warburg", "cpe"])
def test_a_ladder_holds_for_other_parameters(which: str) -> None:
    strip = replace(MODELS[which], coupling=None)
    given = {"permittivity": 3.0, "width": 7e-3, "thickness": 0.2e-3}
    given |= {"diffusion_time": 60.0} if which == "warburg" else {}
    found = elements(library(strip), **given)
    value = {name: float(rest[2]) for name, rest in found.items()}
    sections = [(value[f"Rd{k}"], value[f"C{k}"]) for k in range(1, sum(name[:2] == "Rd" for name in value))]
    assert len(sections) > 10
    ladder = lumped_elements(strip).port.ladder
    assert ladder
    low, high = ladder.band
    s = 2j * np.pi * np.geomspace(low, high, 200) / (3 if which == "warburg" else 1)  # 20 s became 60 s
    series = 6.802721088435374 * 0.2e-3 / (35e-3 * 7e-3)
    found_z = value["Rion"] - series + 1 / (value["Cion"] * s) + sum(r / (1 + r * c * s) for r, c in sections)
    stored = 3.0 * 35e-3 * 7e-3 / 0.2e-3
    ideal = warburg_impedance(s, 60.0 / stored, 60.0) if which == "warburg" else cpe_impedance(s, stored, 0.8)
    assert_allclose(found_z, ideal, rtol=1.1 * ladder.error)


@pytest.mark.parametrize("which", ALL)
def test_every_parameter_is_used_and_explained(which: str) -> None:
    text = library(ALL[which])
    header = text.partition(".subckt")[0]
    used = text[text.index(".param") :]
    for parameter in library_parameters(ALL[which]):
        assert re.search(rf"^\*   {parameter.name} .*\S$", header, re.MULTILINE), parameter.name
        assert re.search(rf"\b{parameter.name}\b", used), parameter.name
        assert parameter.name.lower() == parameter.name


@pytest.mark.parametrize("which", ALL)
def test_only_primitives_that_every_spice_reads(which: str) -> None:
    kinds = {name[0] for name in elements(library(ALL[which]))}
    assert kinds <= set("RLCVEFGHD") | ({"B"} if "growing" in which else set())


def test_diodes_carry_half_the_saturation_current_each() -> None:
    text = library(MODELS["rc sinh"])
    model = re.search(r"\.model electrons D\(is=\{([0-9.e-]+)\*saturation\} n=\{(\S+)\}\)", text)
    assert model
    assert ".param saturation={emission_voltage/rdc}\n" in text
    assert model[2] == "emission_voltage/thermal_voltage"
    bias = float(elements(text)["Vforth"][-1]) / 0.8
    assert float(model[1]) * np.exp(bias) == pytest.approx(0.5, rel=1e-14)
    assert "27 degrees" in text.partition(".subckt")[0]


@pytest.mark.parametrize("name", ["", "a b", "1st", "x\n.control", "x.y"])
def test_a_subcircuit_has_a_plain_name(name: str) -> None:
    with pytest.raises(InputError, match="subcircuit name"):
        library(PAPER, name)


def test_lines_are_short_enough_for_any_reader() -> None:
    for strip in ALL.values():
        assert max(map(len, library(strip).splitlines())) <= 150


# -- plain ngspice -----------------------------------------------------------------------------------------------------


def documented(text: str) -> tuple[str, str]:
    """Options and .tran that a library's header recommends, for a run of 60 s."""
    options = re.search(r"^\* within 1e-6 of the maximum in ngspice: (.*)$", text, re.MULTILINE)
    steps = re.search(r"LONGEST = (\S+) T, FIRST = (\S+) T", text)
    assert options
    assert steps
    longest, first = (float(s) * DURATION for s in steps.groups())
    return options[1], f".tran {first!r} {DURATION!r} 0 {longest!r} uic"


def user_deck(instance: str, options: str, tran: str, *more: str) -> str:
    """A user's circuit: the strip between two supplies, so that nothing in it may lean on ground."""
    lines = [
        "a user's circuit",
        ".include strip.lib",
        "Vplus plus 0 3",
        "Vminus minus 0 -1",
        instance,
        "Vtip tip 0 0",
        "Fway 0 way Vtip 1",
        "Cway way 0 1 ic=0",
        f".options {options}",
        *more,
        tran,
        ".control",
        "run",
        "set numdgt=15 wr_singlescale wr_vecnames",
        "wrdata out.txt i(vplus) v(way)",
        "quit 0",
        ".endc",
        ".end",
    ]
    return "\n".join(lines) + "\n"


@with_ngspice
@pytest.mark.parametrize("which", ["rc", "rc2 growing sinh", "undamped"])  # all of them: test_operating_point
def test_a_users_deck_follows_simulate(which: str, tmp_path: Path) -> None:
    text = library(ALL[which])
    (tmp_path / "strip.lib").write_text(text)
    (tmp_path / "user.cir").write_text(user_deck("X1 plus minus tip ilg_strip", *documented(text)))
    ngspice(tmp_path, "user.cir")
    found = table(tmp_path / "out.txt")
    assert found["time"][-1] == pytest.approx(DURATION)
    at = some(found["time"])
    times = np.minimum(found["time"][at], DURATION)
    current, displacement = expected(ALL[which], times, ("current", "displacement"))
    assert_allclose(-found["i(vplus)"][at], current, rtol=0, atol=1e-6 * current.max())
    close = 1e-5 if which == "undamped" else 1e-6  # the header says so
    assert ("rings for ever" in text) == (which == "undamped")
    assert_allclose(1e-3 * found["v(way)"][at], displacement, rtol=0, atol=close * np.abs(displacement).max())


CHANGES = {
    "rc": {"width": 8e-3, "free_length": 25e-3, "permittivity": 0.7, "youngs_modulus": 2e4, "beam_damping_ratio": 0.5},
    "rc3": {"length": 40e-3, "thickness": 0.3e-3, "electrode_thickness_1": 1e-6, "permittivity_3": 0.9},
    "warburg": {"diffusion_time": 20.0, "permittivity": 2.0, "thickness": 0.8e-3},
    "cpe": {"dc_resistivity": 100.0, "width": 2e-3},
    "rc2 growing sinh": {"emission_voltage": 0.7, "capacitance_slope": 0.1, "dynamic_resistivity_2": 30.0},
    "load inside": {"load_position": 25e-3, "density": 2000.0, "coupling_gain": 3e-9},
    "hanging": {"bending_stiffness": 2e-6, "coupling_natural_frequency": 0.1, "coupling_zero": 0.1},
}


def changed(strip: Actuator, changes: dict[str, float]) -> Actuator:
    """The strip that an instance's parameters describe."""
    geometry, material, coupling = strip.geometry, strip.material, strip.coupling
    assert coupling
    for name, value in changes.items():
        stem, _, number = name.rpartition("_")
        if hasattr(geometry, name):
            geometry = replace(geometry, **{name: value})
        elif hasattr(material, name):
            material = replace(material, **{name: value})
        elif number.isdigit():
            further = list(material.further_branches)
            further[int(number) - 2] = replace(further[int(number) - 2], **{stem: value})
            material = replace(material, further_branches=tuple(further))
        else:
            coupling = replace(coupling, **{name.removeprefix("coupling_"): value})
    return replace(strip, geometry=geometry, material=material, coupling=coupling)


@with_ngspice
@pytest.mark.parametrize("which", CHANGES)
def test_an_instance_may_have_other_parameters(which: str, tmp_path: Path) -> None:
    text = library(ALL[which])
    (tmp_path / "strip.lib").write_text(text)
    given = " ".join(f"{name}={value!r}" for name, value in CHANGES[which].items())
    (tmp_path / "user.cir").write_text(user_deck(f"X1 plus minus tip ilg_strip {given}", *documented(text)))
    ngspice(tmp_path, "user.cir")
    found = table(tmp_path / "out.txt")
    assert found["time"][-1] == pytest.approx(DURATION)
    at = some(found["time"])
    times = np.minimum(found["time"][at], DURATION)
    strip = changed(ALL[which], CHANGES[which])
    current, displacement = expected(strip, times, ("current", "displacement"))
    default, _ = expected(ALL[which], times, ("current", "displacement"))
    assert np.abs(default - current).max() > 1e-3 * current.max() or which in MOUNTED
    assert_allclose(-found["i(vplus)"][at], current, rtol=0, atol=1e-6 * current.max())
    assert_allclose(1e-3 * found["v(way)"][at], displacement, rtol=0, atol=1e-6 * np.abs(displacement).max())


@with_ngspice
@pytest.mark.parametrize("which", ["rc sinh", "cpe", "rc growing"])
def test_without_a_coupling_there_are_two_pins(which: str, tmp_path: Path) -> None:
    strip = replace(MODELS[which], coupling=None)
    text = library(strip)
    (tmp_path / "strip.lib").write_text(text)
    (tmp_path / "user.cir").write_text(user_deck("X1 plus minus ilg_strip", *documented(text)))
    ngspice(tmp_path, "user.cir")
    found = table(tmp_path / "out.txt")
    assert found["time"][-1] == pytest.approx(DURATION)
    at = some(found["time"])
    (current,) = expected(strip, np.minimum(found["time"][at], DURATION), ("current",))
    assert_allclose(-found["i(vplus)"][at], current, rtol=0, atol=1e-6 * current.max())


@with_ngspice
@pytest.mark.parametrize("which", [n for n in TIMED if n in MODELS])
def test_the_deck_of_every_model(which: str, tmp_path: Path) -> None:
    text = deck(strip_netlist(MODELS[which]), STEP, DURATION, MODELS[which])
    recorder = [".control", "run", "set numdgt=15 wr_singlescale wr_vecnames",
                "wrdata out.txt v(out_current) v(out_charge) v(out_displacement)", "quit 0", ".endc"]  # fmt: skip
    body = re.sub(r"\.print.*\n", "", text).removesuffix(".end\n")
    (tmp_path / "deck.cir").write_text("\n".join([body, *recorder, ".end", ""]))
    ngspice(tmp_path, "deck.cir")
    found = table(tmp_path / "out.txt")
    assert found["time"][-1] == pytest.approx(DURATION)
    at = some(found["time"])
    names = ("current", "charge", "displacement")
    waves = expected(MODELS[which], np.minimum(found["time"][at], DURATION), names)
    for name, wave in zip(names, waves, strict=True):
        assert_allclose(found[f"v(out_{name})"][at], wave, rtol=0, atol=1e-6 * np.abs(wave).max(), err_msg=name)


@with_ngspice
def test_the_electron_path_is_a_sinh_from_millivolts_to_ten_vt(tmp_path: Path) -> None:
    strip = replace(MODELS["rc sinh"], coupling=None)
    (tmp_path / "strip.lib").write_text(library(strip))
    lines = ["sweep", ".include strip.lib", "V1 a 0 0", "X1 a 0 ilg_strip", ".dc V1 -8 8 0.0625",
             ".options reltol=1e-10 abstol=1e-16 gmin=1e-18", ".control", "run",
             "set numdgt=15 wr_singlescale wr_vecnames", "wrdata out.txt i(v1)", "quit 0", ".endc",
             ".end", ""]  # fmt: skip
    (tmp_path / "sweep.cir").write_text("\n".join(lines))
    ngspice(tmp_path, "sweep.cir")
    found = table(tmp_path / "out.txt")
    current = lumped_elements(strip).port.electron_current(found["time"])
    assert len(current) == 257
    assert_allclose(-found["i(v1)"], current, rtol=3e-7, atol=1e-12)


# -- two other engines -------------------------------------------------------------------------------------------------


@with_gnucap
@pytest.mark.parametrize(
    "which", [n for n in TIMED if n in MODELS and "growing" not in n]
)  # gnucap has no behavioural sources
def test_gnucap_agrees_on_the_library(which: str, tmp_path: Path) -> None:
    (tmp_path / "strip.lib").write_text(library(MODELS[which]))
    # its sources hide 10 uohm unless told otherwise; less than 1e-7 would cost digits of the current; trapezoids would
    # ring, since it begins with a step far longer than a ladder's fast sections; changes that are added to its matrix
    # (incmode) gather rounding, 1e-3 beside sources of sinh
    lines = ["gnucap", ".include strip.lib", "Vplus plus 0 3", "Vminus minus 0 -1", "X1 plus minus tip ilg_strip",
             "Vtip tip 0 0", "Fway 0 way Vtip 1", "Cway way 0 1 ic=0",
             ".options short=1e-7 reltol=1e-6 chgtol=1e-7 numdgt=9 method=gear noincmode",
             ".print tran i(Vplus)(16.10) v(way)(16.10)", ".tran 0.1 60 0 uic", ".end", ""]  # fmt: skip
    (tmp_path / "gnucap.cir").write_text("\n".join(lines))
    (rows,) = gnucap(tmp_path, "gnucap.cir")
    rows = rows[rows[:, 0] >= 0.999]
    assert len(rows) == 591
    current, displacement = expected(MODELS[which], rows[:, 0], ("current", "displacement"))
    assert_allclose(-rows[:, 1], current, rtol=0, atol=1e-3 * current.max())
    assert_allclose(1e-3 * rows[:, 2], displacement, rtol=0, atol=1e-3 * np.abs(displacement).max())


@with_gnucap
@pytest.mark.parametrize("which", ["rc", "rc3", "warburg"])
def test_gnucap_agrees_on_the_very_deck(which: str, tmp_path: Path) -> None:
    text = deck(strip_netlist(MODELS[which]), STEP, DURATION, MODELS[which])
    (tmp_path / "deck.cir").write_text(text.replace("method=trap", "method=gear short=1e-7 noincmode"))
    (rows,) = gnucap(tmp_path, "deck.cir")
    rows = rows[rows[:, 0] >= 0.999]
    names = ("current", "charge", "displacement")
    for wave, column in zip(expected(MODELS[which], rows[:, 0], names), rows.T[2:], strict=True):
        assert_allclose(column, wave, rtol=0, atol=1e-3 * np.abs(wave).max())


@pytest.mark.parametrize("which", LINEAR)
def test_lcapy_derives_the_same_impedance(which: str) -> None:
    lcapy = pytest.importorskip("lcapy", reason="lcapy is not installed")
    strip = MODELS[which]
    if strip.material.ladder_highest:
        # symbolic algebra on thirty sections takes minutes; how many there are changes nothing here
        strip = replace(strip, material=replace(strip.material, ladder_sections=6.0))
    strip = replace(strip, coupling=None)
    lines = [" ".join([name, *rest]).replace(" ic=0.0", "") for name, rest in elements(library(strip)).items()]
    circuit = lcapy.Circuit("\n".join(re.sub(r"\b(minus|tip)\b", "0", line) for line in lines))
    impedance = circuit.impedance("plus", "0").sympy
    (s,) = impedance.free_symbols
    port = lumped_elements(strip).port
    for frequency in (1e-4, 1e-2, 1.0, 100.0):
        point = 2j * np.pi * frequency
        value = complex(impedance.subs(s, point).evalf(40))
        assert value == pytest.approx(complex(port.impedance(point)), rel=1e-12), frequency


def test_defaults_are_the_actuators_values() -> None:
    strip = replace(PAPER, geometry=Geometry(40e-3, 33e-3, 4e-3, 0.4e-3, load_position=20e-3))
    found = {p.name: p.value for p in library_parameters(strip)}
    for name in ("length", "free_length", "width", "thickness", "load_position"):
        assert found[name] == getattr(strip.geometry, name)
    assert found["youngs_modulus"] == 7600.0
    assert found["coupling_zero"] == 0.2075
    assert "load_position" not in {p.name for p in library_parameters(PAPER)}

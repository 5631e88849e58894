"""The kit for who builds a driver: every deck runs in plain ngspice, and the strip in it moves as `simulate` says."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from every_model import PortEquations, ion_impedance, strip_of
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from spice import elements, ngspice, with_ngspice

import ilg_circuit as ilg
from ilg_circuit.circuit import Load
from ilg_circuit.circuit.library import library_netlist
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.kits.loop import margins, pi_loop
from ilg_circuit.kits.subcircuit import kit_library
from ilg_circuit.kits.tolerances import tolerances
from ilg_circuit.simulation.prediction_band import prediction_band, scaled
from ilg_circuit.simulation.response import Response, simulate
from ilg_circuit.strip.actuator import PAPER, Actuator, Sensing, Uncertainty
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import dumps, save_actuator
from ilg_circuit.strip.ladder import LADDER_BAND
from ilg_circuit.strip.models import electrical_model
from ilg_circuit.strip.uncertainty import Residuals

Array = NDArray[np.float64]
Vectors = dict[str, NDArray[np.complex128]]

LEVEL, DURATION = 4.0, 100.0
STEP = PiecewiseLinear.step(LEVEL)
BAND = (1e-2, 100.0)
COUPLING = ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency")
DECKS = (
    "op",
    "ac",
    "transient",
    "h_bridge",
    "amplifier",
    "position_loop",
    "loop_gain",
    "corners",
    "monte_carlo",
)


def uncertain(strip: Actuator, model: str, size: float = 0.01) -> Actuator:
    """The strip with a covariance of all its parameters, correlated, of about ``size``."""
    names = (*electrical_model(model).names, *COUPLING)
    mixed = size * np.random.default_rng(3).standard_normal((len(names), len(names))) / np.sqrt(len(names))
    covariance = mixed @ mixed.T
    table = tuple(map(tuple, (covariance + covariance.T) / 2))
    return replace(strip, uncertainty=Uncertainty(model, names, table))


FITTED = uncertain(PAPER, "rc")


def raw(path: Path) -> Vectors:
    """The vectors of the last analysis in a file that ``ngspice -b -r`` wrote."""
    head, _, data = path.read_bytes().partition(b"Binary:\n")
    text = head.decode()
    names = re.findall(r"^\s*\d+\s+(\S+)\s+\S+.*$", text.partition("Variables:\n")[2], re.MULTILINE)
    kind = complex if "Flags: complex" in text else float
    rows = np.frombuffer(data, dtype=kind).reshape(-1, len(names))
    names = [re.sub(r"^v\((.*)\)$", r"\1", name) for name in names]
    waves = {name: rows[:, k].astype(complex) for k, name in enumerate(names)}
    return {name: wave.real.astype(complex) if name == "frequency" else wave for name, wave in waves.items()}


@dataclass(frozen=True)
class Kit:
    folder: Path
    runs: dict[str, Vectors]

    def waves(self, deck: str, *names: str) -> list[Array]:
        """Times of a deck's transient, each once, and waveforms there."""
        found = self.runs[deck]
        times, first = np.unique(found["time"].real, return_index=True)
        return [times, *(found[name].real[first] for name in names)]


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Kit:
    folder = ilg.kit(FITTED, tmp_path_factory.mktemp("of") / "kit", "step:4V", f"{DURATION} s")
    assert {path.stem for path in folder.glob("*.cir")} == set(DECKS)
    return Kit(folder, {name: solved(folder, name) for name in DECKS})


def solved(folder: Path, name: str) -> Vectors:
    said = ngspice(folder, f"{name}.cir", raw=f"{name}.raw")
    assert not re.search(r"\berror\b|singular|fatal", said, re.IGNORECASE), said
    return raw(folder / f"{name}.raw")


def some(times: Array, count: int = 150) -> NDArray[np.intp]:
    return np.unique(np.linspace(1, len(times) - 1, count).astype(int))


def close(found: Array, expected: Array, part: float = 1e-5) -> None:
    assert_allclose(found, expected, rtol=0, atol=part * np.abs(expected).max())


def driven(times: Array, volts: Array, at: Array, **how: str) -> Response:
    """What `simulate` says of a strip under the very voltage that a deck put on it."""
    return simulate(PAPER, PiecewiseLinear(times, volts, "recorded"), at, engine="exact", **how)


@with_ngspice
def test_the_operating_point_is_that_of_the_formulas(kit: Kit) -> None:
    said = ngspice(kit.folder, "op.cir")
    position, current = (float(re.search(rf"^\s*{n}\s+(\S+)$", said, re.M)[1]) for n in ("position", "vsense#branch"))
    lumped, coupling = lumped_elements(PAPER), PAPER.coupling
    assert coupling
    assert position == pytest.approx(1e3 * LEVEL * lumped.bending_ratio * coupling.static, rel=1e-6)
    assert current == pytest.approx(LEVEL / lumped.port.dc_resistance, rel=1e-6)


@with_ngspice
def test_small_signals_are_the_port_equations(kit: Kit) -> None:
    found = kit.runs["ac"]
    s = 2j * np.pi * found["frequency"].real
    expected = PortEquations(PAPER, lumped_elements(PAPER).port, s).driven("free", "dynamic", Load())
    assert len(s) == 61
    assert_allclose(found["i(vsense)"], expected["current"], rtol=1e-6)
    known = np.abs(expected["displacement"]) > 1e-9 * np.abs(expected["displacement"]).max()
    assert_allclose(found["position"][known], 1e3 * expected["displacement"][known], rtol=1e-6)


@with_ngspice
@pytest.mark.parametrize("beam", ["dynamic", "static"])
def test_the_transient_is_simulates_with_either_beam(beam: str, kit: Kit, tmp_path: Path) -> None:
    text = (kit.folder / "transient.cir").read_text()
    one = text.replace("position ilg_actuator", f"position ilg_actuator static_beam={int(beam == 'static')}")
    assert one != text
    (tmp_path / "strip.lib").write_text((kit.folder / "strip.lib").read_text())
    (tmp_path / "one.cir").write_text(one)
    times, position, current = Kit(tmp_path, {"one": solved(tmp_path, "one")}).waves("one", "position", "i(vsense)")
    at = some(times)
    response = simulate(PAPER, STEP, np.minimum(times[at], DURATION), beam=beam, engine="exact")
    close(position[at], 1e3 * response.displacement)
    close(current[at], response.current)


@with_ngspice
@pytest.mark.parametrize("deck", ["h_bridge", "amplifier", "position_loop"])
def test_a_driven_strip_moves_as_simulate_says(deck: str, kit: Kit) -> None:
    names = ("strip" if deck == "h_bridge" else "plus", "i(vsense)", "position")
    times, volts, current, position = kit.waves(deck, *names)
    at = some(times)
    response = driven(times, volts, times[at])
    close(current[at], response.current)
    close(position[at], 1e3 * response.displacement)


@with_ngspice
def test_the_bridge_has_dead_time_and_the_mean_of_its_pulses(kit: Kit) -> None:
    times, high, low, volts, current = kit.waves("h_bridge", "lefthigh", "leftlow", "strip", "i(vsense)")
    assert not ((high > 0.5) & (low > 0.5)).any()
    both_open = (high < 0.5) & (low < 0.5)
    held = np.interp(np.arange(1e-5, times[-1], 1e-7), times, both_open.astype(float)).mean()
    assert 0.015 < held < 0.025  # two times 10 us of a millisecond
    mean = np.trapezoid(volts, times) / times[-1]
    switches = PAPER_STEP_RESISTANCE / (PAPER_STEP_RESISTANCE + 1.0)  # two of 0.5 ohm
    assert mean == pytest.approx((0.8 - 0.01) * 5.0 * switches, rel=0.01)
    assert current.max() == pytest.approx(5.0 / (PAPER_STEP_RESISTANCE + 1.0), rel=0.01)


@with_ngspice
def test_the_amplifier_holds_its_limit_then_its_voltage(kit: Kit) -> None:
    times, volts, current = kit.waves("amplifier", "plus", "i(vsense)")
    limit = float(re.search(r"most=(\S+)", (kit.folder / "amplifier.cir").read_text())[1])
    wanted = LEVEL / PAPER_STEP_RESISTANCE
    assert limit == pytest.approx(wanted / 2, rel=0.05)
    assert current.max() < 1.02 * limit
    held = (times > 0.01) & (times < 1.0)
    assert_allclose(current[held], limit, rtol=0.02)
    assert volts[-1] == pytest.approx(LEVEL, rel=1e-3)


#: What a step meets at first: Rdc beside Rd.
PAPER_STEP_RESISTANCE = 1 / (1 / lumped_elements(PAPER).port.dc_resistance + 1 / 19.436346)


@with_ngspice
def test_the_position_loop_arrives_within_its_limit(kit: Kit) -> None:
    _, volts, position = kit.waves("position_loop", "plus", "position")
    assert np.abs(volts).max() < LEVEL + 0.01
    assert position[-1] == pytest.approx(3.0, rel=0.01)  # three quarters of 3.98, as one would write it
    assert position.max() < 1.15 * 3.0


@with_ngspice
def test_the_margin_is_that_of_the_port_equations(kit: Kit) -> None:
    said = ngspice(kit.folder, "loop_gain.cir")
    crossover, phase = (float(re.search(rf"^{n}\s*=\s*(\S+)", said, re.M)[1]) for n in ("crossover", "phase"))
    deck, page = ((kit.folder / name).read_text() for name in ("loop_gain.cir", "README.md"))
    gain, reset = (float(re.search(rf" {n}=(\S+)", deck)[1]) for n in ("gain", "reset"))
    f = np.geomspace(1e-3, 1.0, 20001)
    s = 2j * np.pi * f
    plant = PortEquations(PAPER, lumped_elements(PAPER).port, s).driven("free", "dynamic", Load())["displacement"]
    loop = 1e3 * plant * gain * (1 + 1 / (reset * s))
    at, margin = margins(f, loop)
    assert crossover == pytest.approx(at, rel=0.01)
    assert 180 + np.degrees(phase) == pytest.approx(margin, rel=0.01)
    assert 30 < margin < 90
    assert f"margin {margin:.1f} degrees" in page
    assert (1 / np.abs(1 + loop)).max() < 1.6
    found = kit.runs["loop_gain"]
    assert_allclose(-found["loop"].conj(), found["position"].conj(), rtol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 1e-3, 0.05, 0.3])
def test_the_loop_is_stable_however_the_beam_rings(damping: float) -> None:
    strip = replace(PAPER, material=replace(PAPER.material, beam_damping_ratio=damping))
    made = pi_loop(strip, LEVEL, 3.0)
    lumped, k, judged = lumped_elements(strip), PAPER.coupling, max(damping, 1e-6)
    assert k
    # y/u of EC (26) with the beam's second order; what it reflects is nothing here
    wb = np.sqrt(lumped.stiffness / lumped.mass)
    gain = 1e3 * lumped.bending_ratio * k.gain * made.gain * wb**2 / made.reset
    zeros = gain * np.polymul([1.0, k.zero], [made.reset, 1.0])
    poles = np.polymul([1.0, 2 * k.damping_ratio * k.natural_frequency, k.natural_frequency**2, 0.0],
                       [1.0, 2 * judged * wb, wb**2])  # fmt: skip
    assert np.roots(np.polyadd(poles, zeros)).real.max() < 0
    assert made.sensitivity <= 1.6
    assert ("beam_damping_ratio" in made.text) == (damping == 0)


@with_ngspice
def test_corners_are_simulates_of_the_moved_strip(kit: Kit) -> None:
    uncertainty = FITTED.uncertainty
    assert uncertainty
    covariance = np.array(uncertainty.covariance)
    names = [f"y{k}" for k in range(2 * len(covariance) + 1)]
    times, *waves = kit.waves("corners", *names)
    at = some(times, 60)
    for k in (0, 1, 4, 7, 14):
        place, sign = divmod(k - 1, 2)
        move = covariance[place] / np.sqrt(covariance[place, place]) * (2 if sign == 0 else -2)
        strip = scaled(FITTED, dict(zip(uncertainty.names, np.exp(move), strict=True)), LADDER_BAND) if k else PAPER
        close(waves[k][at], 1e3 * simulate(strip, STEP, np.minimum(times[at], DURATION), engine="exact").displacement)


@with_ngspice
def test_monte_carlos_spread_is_the_covariances_band(kit: Kit) -> None:
    times, *found = kit.waves("monte_carlo", "mean", "spread", "mean_current", "spread_current")
    at = some(times, 40)[8:]
    when = np.minimum(times[at], DURATION)
    band = prediction_band(FITTED, STEP, when, engine="exact")
    response = simulate(PAPER, STEP, when, engine="exact")
    mean, spread, mean_current, spread_current = (wave[at] for wave in found)
    assert_allclose(spread, 1e3 * band.stderr["displacement"], rtol=0.1)
    assert_allclose(spread_current, band.stderr["current"], rtol=0.1)
    close(mean, 1e3 * response.displacement, 1e-3)
    close(mean_current, response.current, 1e-3)
    each = np.array(kit.waves("monte_carlo", *(f"y{k}" for k in range(1, 51)))[1:])[:, at]
    close(spread, each.std(axis=0, ddof=1))


@pytest.mark.parametrize("model", ["rc", "rc3", "warburg", "cpe", "rc2+growing+sinh"])
def test_tolerances_move_the_elements_as_the_fit_says(model: str) -> None:
    strip = uncertain(strip_of(model, 2.0, band=BAND), model, 0.1)
    made, uncertainty = tolerances(strip), strip.uncertainty
    assert made
    assert uncertainty
    assert_allclose(made.factor @ made.factor.T, made.covariance, atol=1e-15)
    assert set(made.names) | set(made.fixed) == set(uncertainty.names)
    assert made.fixed == (("cpe_exponent",) if model == "cpe" else ())
    z = np.random.default_rng(5).standard_normal(len(made.names))
    found = elements(kit_library(strip, made), **{f"z{k}": float(x) for k, x in enumerate(z, 1)})
    last = {name: [word for word in rest if word[:3] != "ic="][-1] for name, rest in found.items()}
    value = {name: float(word) for name, word in last.items() if re.match(r"[-\d.]", word)}
    factors = dict(zip(made.names, np.exp(made.factor @ z), strict=True))
    moved = scaled(strip, factors, BAND)
    port, ladder = lumped_elements(moved).port, lumped_elements(moved).port.ladder
    switched = {"Vdrive", "Ltip", "Htip", "Eback"}
    for element in library_netlist(moved, "dynamic").elements:
        ions = ladder is not None and re.match("R?(ion|d)x?[0-9]*$|C(ion)?x?[0-9]*$|Eheld|Rheld", element.name)
        if element.name not in switched and not element.law and not ions:
            assert value[element.name] == pytest.approx(element.value, rel=1e-9), element.name
    if ladder is not None:  # its sections move along, so that it stands for another one of the same kind
        s = 2j * np.pi * np.geomspace(3 * BAND[0], BAND[1] / 3, 50)
        sections = [(value[f"Rd{k}"], value[f"C{k}"]) for k in range(1, len(ladder.sections) + 1)]
        relaxing = sum(r / (1 + r * c * s) for r, c in sections)
        assert_allclose(value["Rion"] + 1 / (value["Cion"] * s) + relaxing, ion_impedance(port, s), rtol=1e-3)


@with_ngspice
@pytest.mark.parametrize("model", ["rc2+growing+sinh", "warburg"])
def test_a_kit_of_another_model(model: str, tmp_path: Path) -> None:
    strip = strip_of(model, 2.0, band=BAND)
    strip = replace(strip, coupling=replace(PAPER.coupling, beam="static"))
    folder = ilg.kit(strip, tmp_path / "kit", "square:-2V..2V,5s", "10 s")
    assert "+ static_beam=1.0\n" in (folder / "strip.lib").read_text()
    assert not {"corners.cir", "monte_carlo.cir"} & {path.name for path in folder.iterdir()}
    assert "no [uncertainty]" in (folder / "README.md").read_text()
    solved(folder, "op")
    solved(folder, "loop_gain")
    times, position, current = Kit(folder, {"t": solved(folder, "transient")}).waves("t", "position", "i(vsense)")
    at = some(times, 60)
    at = at[np.abs(times[at][:, None] - np.arange(0.0, 11, 2.5)).min(axis=1) > 1e-4]
    engine = "exact" if strip.material.model.linear else "ngspice"
    drive = PiecewiseLinear.square(-2.0, 2.0, 5.0, 10.0)
    response = simulate(strip, drive, np.minimum(times[at], 10.0), engine=engine)
    close(position[at], 1e3 * response.displacement)
    close(current[at], response.current)


def test_refusals_are_one_line(run: Run, tmp_path: Path) -> None:
    save_actuator(replace(PAPER, coupling=None), Path("port.toml"))
    Path("file").write_text("")
    Path("mine").mkdir()
    Path("mine/notes.txt").write_text("keep")
    assert_one_line(run("netlist", "port.toml", "--kit", "kit"), "no [coupling]", "netlist --out strip.lib")
    assert_one_line(run("netlist", "paper", "--kit", "file"), "give the name of a folder")
    assert_one_line(run("netlist", "paper", "--kit", "mine"), "notes.txt", "--force")
    assert_one_line(run("netlist", "paper", "--kit", "kit", "--drive", "step:0V"), "more than 0 V")
    assert_one_line(run("netlist", "paper", "--kit", "kit", "--tip", "clamped"), "leave out --tip and --load")
    assert_one_line(run("netlist", "paper"), "--out", "--kit")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "mine", "port.toml"]
    with pytest.raises(InputError, match="no \\[coupling\\]"):
        ilg.kit(replace(PAPER, coupling=None), "kit")


def test_a_kit_tells_of_the_misfit_that_its_decks_are_without(tmp_path: Path) -> None:
    left = Residuals("current", (1.0, 10.0), (3e-3, 3e-3))
    strip = replace(PAPER, uncertainty=Uncertainty("rc", ("capacitance",), ((1e-4,),), 2.0, (left,)))
    text = (ilg.kit(strip, tmp_path / "kit", "step:2V", "10 s") / "README.md").read_text()
    assert "- current: 0.003 A/V\n" in text
    assert "monte_carlo.cir are without it" in text
    with pytest.raises(InputError, match=r"has a \[sensing\] of its own"):
        ilg.kit(replace(PAPER, sensing=Sensing(instantaneous=3.0)), tmp_path / "other")


def test_a_kit_replaces_a_kit_and_nothing_else(run: Run) -> None:
    assert run("netlist", "paper", "--kit", "kit", "--out", "strip.lib").code == 0
    assert ".subckt ilg_strip plus minus tip\n" in Path("strip.lib").read_text()
    first = Path("kit/README.md").read_text()
    assert "call: ilg-circuit netlist paper --kit kit" in first
    assert run("netlist", "paper", "--kit", "kit", "--drive", "step:2V").code == 0
    assert Path("kit/README.md").read_text() != first
    Path("kit/board.kicad_pcb").write_text("mine")
    assert_one_line(run("netlist", "paper", "--kit", "kit"), "board.kicad_pcb")
    assert run("netlist", "paper", "--kit", "kit", "--force").code == 0
    assert not Path("kit/board.kicad_pcb").exists()


def test_what_a_kit_refuses_writes_no_deck_either(run: Run, tmp_path: Path) -> None:
    (tmp_path / "four.toml").write_text(
        dumps(PAPER)
        + '\n[electrodes]\nsheet_resistance_1 = "0.2 ohm"\nsheet_resistance_2 = "0.2 ohm"\nsegments_1 = 4\n'
    )
    for out in ("out.cir", "out.lib"):
        refused = run("netlist", f"{tmp_path}/four.toml", "--out", f"{tmp_path}/{out}", "--kit", f"{tmp_path}/kit")
        assert_one_line(refused, "[electrodes]")
    refused = run("netlist", "paper", "--out", f"{tmp_path}/out.txt", "--kit", f"{tmp_path}/kit")
    assert_one_line(refused, ".cir")
    assert [path.name for path in tmp_path.iterdir()] == ["four.toml"]

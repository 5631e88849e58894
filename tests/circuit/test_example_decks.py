"""The circuits in netlists/: plain ``ngspice -b`` runs each once, and what it writes is this package's own answer."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from spice import NGSPICE, ngspice, table

from ilg_circuit.circuit import Element, Load, Netlist, Output, strip_netlist
from ilg_circuit.circuit.netlist import GROUND
from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.simulation.response import simulate
from ilg_circuit.simulation.sensing import sense
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements

Array = NDArray[np.float64]
Results = Callable[[str], dict[str, Array]]

FOLDER = Path(__file__).parents[2] / "netlists"
#: The circuits around the library, written by hand.
EXAMPLES = sorted(p.stem for p in FOLDER.glob("*.cir") if not p.name.startswith("paper_"))


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The result of an example, which runs at its first use."""
    if NGSPICE is None:
        pytest.skip("the program ngspice is not installed")
    folder = tmp_path_factory.mktemp("netlists")
    for file in FOLDER.glob("*.*"):
        if file.suffix in (".cir", ".lib"):
            shutil.copy(file, folder)
    bridge = folder / "h_bridge.cir"  # three thousand pulses tell what ten thousand do
    whole = bridge.read_text(encoding="utf-8")
    assert whole.count(".tran 0.01 10 0 ") == 1
    bridge.write_text(whole.replace(".tran 0.01 10 0 ", ".tran 0.01 3 0 "), encoding="utf-8")
    done: dict[str, dict[str, Array]] = {}

    def result(name: str) -> dict[str, Array]:
        if name not in done:
            printed = ngspice(folder, f"{name}.cir")
            assert printed.count("Doing analysis") == 1
            assert "rror" not in printed
            done[name] = table(folder / f"{name}.txt")
        return done[name]

    return result


def near(found: Array, expected: Array, part: float) -> None:
    """Equal within a part of the largest expected value, which is not zero."""
    largest = float(np.abs(expected).max())
    assert largest > 0
    assert_allclose(found, expected, rtol=0, atol=part * largest)


def away(times: Array, *edges: float) -> NDArray[np.intp]:
    """Some hundred points, none within the rise that a jump has in a netlist."""
    at = np.unique(np.linspace(0, len(times) - 1, 300).astype(int))
    return at[np.abs(times[at][:, None] - np.array([*edges, np.inf])).min(axis=1) > 1e-4]


def solved(elements: list[Element], outputs: list[Output], drive: Drive, times: Array) -> list[Array]:
    netlist = Netlist("reference", tuple(elements), tuple(outputs))
    waves = transient(netlist, drive, times, engine="exact", accuracy=1e-9, interpolate=False)
    return [waves.output(o.name) for o in outputs]


@pytest.mark.parametrize("example", EXAMPLES)
def test_examples_explain_themselves(example: str) -> None:
    text = (FOLDER / f"{example}.cir").read_text(encoding="utf-8")
    result, *columns = re.findall(r"^wrdata (.*)", text, re.MULTILINE)[0].split()
    comments = "\n".join(line for line in text.splitlines() if line.startswith("*"))
    assert "Look at" in comments
    assert re.search(r"1 V = 1 \w+|in ampere", comments)
    assert result == f"{example}.txt"
    assert result in comments
    # a vector is explained before the list of the file's columns
    explained = comments.partition("* run:")[0]
    assert columns
    for column in columns:
        assert column in explained or re.fullmatch(r"v\((way[2-4]|out)\)", column), column
    assert max(map(len, text.splitlines())) <= 120
    # an interactive session is not ended
    assert re.search(r"if \$\?batchmode\n\s+quit 0\nend", text)


def test_step(results: Results) -> None:
    found = results("step")
    at = away(found["time"])
    expected = simulate(PAPER, PiecewiseLinear.step(4.0), found["time"][at], engine="exact")
    near(-found["i(vdrive)"][at], expected.current, 1e-6)
    near(1e-3 * found["v(way)"][at], expected.displacement, 1e-6)


def test_mass_on_the_tip(results: Results) -> None:
    found = results("mass_on_tip")
    at = away(found["time"], 15, 30, 45, 60)
    drive = PiecewiseLinear.square(0.0, 4.0, 30.0, 60.0)
    expected = simulate(PAPER, drive, found["time"][at], load=Load(mass=2e-5), engine="exact")
    near(-found["i(vdrive)"][at], expected.current, 1e-5)
    near(1e-3 * found["v(way)"][at], expected.displacement, 1e-5)
    near(1e-6 * found["v(tip)"][at], expected.force, 5e-5)


@pytest.mark.parametrize("port", ["open", "short"])
def test_sensor(results: Results, port: str) -> None:
    found = results("sensor")
    at = away(found["time"])
    # mass and damping carry the same velocity as the tip: it goes straight into the beam's compliance
    elements = [
        replace(e, nodes=tuple("terminal" if n == "drive" else n for n in e.nodes))
        for e in strip_netlist(PAPER).elements
        if e.name not in ("Vdrive", "Ltip", "Rtip")
    ]
    elements += [Element("Vdrive", ("move", GROUND), 0.0), Element("Gmove", ("beam", GROUND, "move", GROUND), 1.0)]
    if port == "open":
        elements.append(Element("Rmeter", ("terminal", GROUND), 1e10))
        output = Output("voltage", "V", (("v(terminal)", 1.0),))
    else:
        elements.append(Element("Vshort", ("terminal", GROUND), 0.0))
        output = Output("current", "A", (("i(Vshort)", 1.0),))
    (expected,) = solved(elements, [output], Sine(0.5, 0.05), found["time"][at])
    written = found["v(open)" if port == "open" else "i(vshort)"]
    near(written[at], expected, 1e-5)
    # and what `sense` says of the motion that this velocity makes, here of straight pieces
    times = np.linspace(0.0, 120.0, 1201)
    motion = PiecewiseLinear(times, 0.5e-3 / (0.1 * np.pi) * (1 - np.cos(0.1 * np.pi * times)), "to and fro")
    sensed = sense(PAPER, motion, times, terminals=port, engine="exact")
    answer = sensed.voltage if port == "open" else sensed.current
    near(np.interp(times, found["time"], written), answer if port == "open" else -answer, 1e-3)


def test_amplifier_limits_the_current_and_then_controls_the_voltage(results: Results) -> None:
    found = results("amplifier")
    time, voltage, current = found["time"], found["v(out)"], found["i(vsense)"]
    assert current.max() == pytest.approx(0.1, rel=0.01)
    # under a constant current I the voltage is I Rdc (1 - Rdc/(Rdc + Rd) exp(-t/((Rdc + Rd) C))): when is it 4 V?
    lumped = lumped_elements(PAPER)
    rdc, total = lumped.port.dc_resistance, lumped.port.dc_resistance + lumped.port.dynamic_resistance
    limited = total * lumped.port.capacitance * np.log(rdc / total / (1 - 4.0 / (0.1 * rdc)))
    assert 5 < limited < 10
    assert_allclose(current[(time > 0.01) & (time < 0.95 * limited)], 0.1, rtol=0.01)
    assert time[current > 0.098].max() == pytest.approx(limited, rel=0.03)
    assert_allclose(voltage[time > limited + 1], 4.0, rtol=2e-4)
    # the strip's own answer to the voltage that it got
    drive = PiecewiseLinear(np.concatenate([[0.0], time]), np.concatenate([[0.0], voltage]), "of the amplifier")
    at = away(time)
    expected = simulate(PAPER, drive, time[at], engine="exact")
    near(current[at], expected.current, 1e-4)
    near(1e-3 * found["v(way)"][at], expected.displacement, 1e-4)


def test_pulses_of_a_bridge_are_a_steady_voltage(results: Results) -> None:
    found = results("h_bridge")
    time = found["time"]
    assert time[-1] == pytest.approx(3.0)
    behind_switches = replace(
        PAPER.material,
        electrode_resistivity_1=1.0 * PAPER.geometry.length * PAPER.geometry.width / 1e-6,  # two switches: 1 ohm
        electrode_thickness_1=1e-6,
    )
    drive = PiecewiseLinear.step(4.0)
    strip = replace(PAPER, material=behind_switches)
    # the charge delivered: that on the ions, and what leaked through Rdc, from fine samples of the current
    fine = np.linspace(0.0, 3.0, 3001)
    exact = simulate(strip, drive, fine, engine="exact")
    delivered = np.concatenate([[0.0], np.cumsum((exact.current[1:] + exact.current[:-1]) / 2 * np.diff(fine))])
    edges = np.round(np.arange(0.0, 3.01, 0.1), 6)
    mean = np.diff(np.interp(edges, fine, delivered)) / 0.1
    for column, close in (("v(pulsed)", 0.01), ("v(steady)", 1e-3)):
        charge = np.interp(edges, np.concatenate([[0.0], time]), np.concatenate([[0.0], found[column]]))
        assert_allclose(np.diff(charge) / 0.1, mean, rtol=close)
    for column in ("v(way)", "v(steady_way)"):
        way = np.interp(edges, np.concatenate([[0.0], time]), np.concatenate([[0.0], found[column]]))
        near(1e-3 * way, np.interp(edges, fine, exact.displacement), 1e-3)


def gripper() -> tuple[list[Element], list[Output]]:
    """Five strips behind 2 ohm, as one element list; their sizes are those that the deck gives them."""
    text = (FOLDER / "gripper.cir").read_text(encoding="utf-8")
    instances = re.findall(r"^X\d out 0 tip\d ilg_strip(.*)", text, re.MULTILINE)
    assert len(instances) == 5
    elements = [Element("Vdrive", ("source", GROUND), 0.0), Element("Rdrive", ("source", "out"), 2.0)]
    outputs = [Output("current", "A", (("i(Vdrive)", -1.0),)), Output("voltage", "V", (("v(out)", 1.0),))]
    for k, given in enumerate(instances):
        finger = {name: float(value) for name, value in re.findall(r"(\w+)=(\S+)", given)}
        strip: Actuator = replace(PAPER, geometry=replace(PAPER.geometry, **finger))
        netlist = strip_netlist(strip)
        names = {"drive": "out", GROUND: GROUND}
        elements += [
            replace(e, name=f"{e.name}_{k}", nodes=tuple(names.get(n, f"{n}_{k}") for n in e.nodes))
            for e in netlist.elements
            if e.name != "Vdrive"
        ]
        moved = next(o for o in netlist.outputs if o.name == "displacement")
        terms = tuple((f"v({names.get(q[2:-1], q[2:-1] + f'_{k}')})", c) for q, c in moved.terms)
        outputs.append(Output(f"way{k + 1}", "m", terms))
    return elements, outputs


def test_gripper(results: Results) -> None:
    found = results("gripper")
    at = away(found["time"], 30, 60)
    drive = PiecewiseLinear.square(-3.0, 3.0, 60.0, 60.0)
    current, voltage, *ways = solved(*gripper(), drive, found["time"][at])
    near(-found["i(vdrive)"][at], current, 1e-5)
    near(found["v(out)"][at], voltage, 1e-5)
    for k, way in enumerate(ways, 1):
        near(1e-3 * found[f"v(way{k})"][at], way, 1e-5)
    largest = [np.abs(way).max() for way in ways]
    assert len({f"{value:.3g}" for value in largest}) == 4  # width does not matter, thickness and length do

"""A strip with sheet resistance as a line of cells, against the closed forms of the transmission line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from ilg_circuit.circuit.line_response import LINE_ERROR, chosen_layout, line_response
from ilg_circuit.circuit.strip import strip_netlist
from ilg_circuit.circuit.wiring import Wiring, joined, wiring
from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.solve.spectrum import spectrum
from ilg_circuit.solve.transient import transient
from ilg_circuit.strip.actuator import PAPER, Actuator, Electrodes
from ilg_circuit.strip.cells import layout
from ilg_circuit.strip.elements import lumped_elements, lumped_port

STEP = PiecewiseLinear.step(4.0)
WAVES = ("current", "charge", "displacement")


def line(sheet: float, *, clamped: float = 5e-3, strip: Actuator = PAPER, **electrodes: Any) -> Actuator:
    """The paper's strip, 30 mm free, with two sheets of this resistance; 35 mm free without a clamped part."""
    free = 35e-3 - clamped
    sheets = Electrodes(sheet, sheet, **electrodes)
    return replace(strip, geometry=replace(strip.geometry, free_length=free), electrodes=sheets)


def gamma(sheet: float, frequency: float) -> complex:
    port = lumped_port(PAPER)
    admittance = 1 / (complex(port.impedance(2j * np.pi * frequency)) * 35e-3)
    return complex(np.sqrt(2 * sheet / 5e-3 * admittance))


@pytest.mark.parametrize("beam", ["static", "dynamic"])
@pytest.mark.parametrize("cells", [1, 2, 7])
def test_without_sheet_resistance_it_is_the_lumped_strip(cells: int, beam: str) -> None:
    t = np.linspace(0.0, 60.0, 25)
    lump = transient(strip_netlist(PAPER, beam=beam), STEP, t, engine="exact")
    found = transient(strip_netlist(line(0.0, cells=cells), beam=beam), STEP, t, engine="exact")
    for name in WAVES:
        assert np.abs(found.output(name) - lump.output(name)).max() <= 1e-9 * np.abs(lump.output(name)).max()
    if beam == "static":
        curvature = 2 * lump.output("displacement") / 30e-3**2
        for k in range(1, cells + 1):
            assert found.output(f"curvature_{k}") == pytest.approx(curvature, rel=1e-9, abs=1e-9 * curvature.max())


@pytest.mark.parametrize(
    ("model", "beam"),
    [
        ({"diffusion_time": "20 s", "ladder_sections": 4}, "dynamic"),
        ({"cpe_exponent": 0.8, "ladder_sections": 4}, "static"),
        ({"load_position": "17 mm"}, "dynamic"),
    ],
)
def test_any_model_and_place_of_the_load(model: dict[str, Any], beam: str) -> None:
    strip, t = PAPER.with_(**model), np.linspace(0.0, 30.0, 11)
    lump = transient(strip_netlist(strip, beam=beam), STEP, t, engine="exact")
    found = transient(strip_netlist(line(0.0, strip=strip, cells=4), beam=beam), STEP, t, engine="exact")
    for name in WAVES:
        assert np.abs(found.output(name) - lump.output(name)).max() <= 1e-9 * np.abs(lump.output(name)).max()


#: Sheet resistance, frequency, impedance by sqrt(r/y) coth(gamma L), errors of 10, 20, 40 cells.
TABLE = [
    (0.244, 0.1, 20.0400 - 4.2960j, (2.9e-4, 7.1e-5, 1.8e-5)),
    (5.0, 0.1, 38.0928 - 4.9967j, (4.8e-3, 1.2e-3, 3.0e-4)),
    (200.0, 0.1, 231.589 - 25.953j, (0.17, 0.044, 0.011)),
    (200.0, 0.001, 890.48 - 463.78j, (9.4e-3, 2.3e-3, 5.9e-4)),
]


@pytest.mark.parametrize(("sheet", "frequency", "impedance", "errors"), TABLE)
def test_impedance_against_the_transmission_line(
    sheet: float, frequency: float, impedance: complex, errors: tuple[float, ...]
) -> None:
    g = gamma(sheet, frequency)
    exact = 2 * sheet / 5e-3 / g / np.tanh(g * 35e-3)
    assert exact == pytest.approx(impedance, rel=3e-5)
    found = []
    for cells in (10, 20, 40):
        strip = line(sheet, clamped=0.0, contact="end", cells=cells)
        current = spectrum(strip_netlist(strip, beam="static"), [frequency], engine="exact").output("current")
        found.append(abs(1 / current[0] / exact - 1))
    assert found == pytest.approx(errors, rel=0.03)
    if sheet < 200:  # second order
        assert found[1] / found[2] == pytest.approx(4.0, rel=0.03)


@pytest.mark.parametrize(
    ("contact", "sheet", "ratio"),
    [(c, r, x) for c, row in {"clamp": (0.970, 0.669, 0.175), "end": (0.949, 0.519, 0.032)}.items()
     for r, x in zip((0.244, 5.0, 200.0), row, strict=True)],
)  # fmt: skip
def test_tip_over_that_of_an_equipotential_strip(contact: str, sheet: float, ratio: float) -> None:
    def tip(strip: Actuator) -> complex:
        return complex(spectrum(strip_netlist(strip, beam="static"), [0.1], engine="exact").output("displacement")[0])

    found = [tip(line(sheet, contact=contact, cells=n)) / tip(PAPER) for n in (20, 40)]
    limit = found[1] + (found[1] - found[0]) / 3
    assert abs(limit) == pytest.approx(ratio, abs=1e-3)
    if contact == "clamp":
        g = gamma(sheet, 0.1) * 30e-3
        assert limit == pytest.approx(2 / g**2 * (g * np.tanh(g) - (1 - 1 / np.cosh(g))), abs=2e-3)
    if (contact, sheet) == ("clamp", 5.0):
        closed = 2 / g**2 * (g * np.tanh(g) - (1 - 1 / np.cosh(g)))
        errors = [abs(tip(line(sheet, cells=n)) / tip(PAPER) / closed - 1) for n in (10, 20, 40)]
        assert errors == pytest.approx([5.4e-3, 1.35e-3, 3.4e-4], rel=0.02)


def test_voltage_along_the_strip_at_first_and_in_the_end() -> None:
    """The base bends first: the curvature follows the voltage, whose line is that of Rd parallel Rdc, then of Rdc."""
    cells, sheet, port = 40, 200.0, lumped_port(PAPER)
    strip = line(sheet, cells=cells)
    found = transient(strip_netlist(strip, beam="static"), STEP, [1e-4, 3e4], engine="exact")
    k = np.array([found.output(f"curvature_{j}") for j in range(1, cells + 1)])
    x = (np.arange(cells) + 0.5) / cells * 30e-3
    conductances = (1 / port.dynamic_resistance + 1 / port.dc_resistance, 1 / port.dc_resistance)
    for column, conductance, tolerance in zip(k.T, conductances, (0.03, 1e-3), strict=True):
        g = np.sqrt(2 * sheet / 5e-3 * conductance / 35e-3)
        closed = np.cosh(g * (30e-3 - x)) / np.cosh(g * 30e-3)
        assert column / column[0] == pytest.approx(closed / closed[0], abs=tolerance)


def test_cells_are_as_many_as_the_error_needs() -> None:
    counts = []
    for sheet in (0.244, 5.0):
        strip = line(sheet)
        cells, stated = chosen_layout(strip, (1e-3, 10.0))
        counts.append(len(cells.free))
        assert stated <= LINE_ERROR
        s = 2j * np.pi * np.geomspace(1e-3, 10.0, 5)
        many = cells.finer(4)
        own, fine = (
            line_response(strip, c, joined(strip.electrodes), s, lumped_elements(strip)) for c in (cells, many)
        )
        actual = (np.abs(own.current - fine.current) / np.abs(fine.current)).max()
        assert 0.7 * stated < actual <= 1.01 * stated
    assert counts == sorted(set(counts))
    given, stated = chosen_layout(line(5.0, cells=3), (1e-3, 10.0))
    assert (len(given.free), stated > LINE_ERROR) == (3, True)


def test_the_response_by_nodes_is_that_of_the_circuit() -> None:
    """Different cuts on both sides, gaps that leak, leads, sources between pairs, an open segment."""
    sheets = Electrodes(
        5.0, 2.0, segments_1=4, lengths_2=(12e-3, 15e-3), gap=0.5e-3, gap_resistance=900.0, contact="each",
        lead_resistance=1.5, cells=16,
    )  # fmt: skip
    strip, f = replace(PAPER, electrodes=sheets), np.array([0.01, 1.0])
    for keys, opened in ((["2"], ["4"]), (["3:-1"], ["1"]), (["-2"], [])):
        wires, cells = wiring(sheets, keys, opened), layout(strip, 16)
        found = spectrum(strip_netlist(strip, beam="static", wires=wires, layout=cells), f, engine="exact")
        own = line_response(strip, cells, wires, 2j * np.pi * f, lumped_elements(strip))
        moved = found.output("displacement") / spectrum(strip_netlist(PAPER, beam="static"), f, engine="exact").output(
            "displacement"
        )
        assert own.mean[0] == pytest.approx(moved, rel=1e-9)
        assert abs(own.current[0]) == pytest.approx(abs(found.output("current")), rel=1e-9)


def test_layout_of_cells() -> None:
    sheets = Electrodes(1.0, 1.0, segments_1=3, lengths_2=(10e-3, 12e-3), gap=1e-3, contact_length=2e-3, cells=11)
    found = layout(replace(PAPER, electrodes=sheets), 11)
    assert sum(cell.length for cell in found.cells) == pytest.approx(35e-3, rel=1e-12)
    assert sum(cell.length for cell in found.free) == pytest.approx(30e-3, rel=1e-12)
    assert sum(cell.active and cell.free for cell in found.cells) == 11
    contact = [cell for cell in found.cells if cell.contact]
    assert [(round(1e3 * c.start, 9), round(1e3 * c.end, 9)) for c in contact] == [(-5.0, -3.0)]
    assert found.finer().free[-1].segments == (2, None)  # side 2 ends at 23 mm
    at = 30e-3
    assert sum(cell.arm(at) for cell in found.cells) == pytest.approx(at**2 / 2, rel=1e-12)


def test_wiring_of_pins() -> None:
    sheets = Electrodes(1.0, 1.0, segments_1=3, segments_2=2)
    assert joined(sheets) == Wiring(((("p1", "p2", "p3"), "0"),))
    assert wiring(sheets, ["1", "-2", "3:-1"], ["2"]) == Wiring(
        ((("p1",), "0"), (("m2",), "0"), (("p3",), "m1")), ("p2",)
    )


@pytest.mark.parametrize(
    ("keys", "opened", "told"),
    [
        (["4"], [], "segment '4' is not there: side 1 has 3 segments, 1 to 3"),
        (["-3"], [], "side 2 has 2 segments, -1 to -2"),
        (["0"], [], "not there"),
        (["one"], [], "not understood"),
        (["1", "+1"], [], "are one"),
        (["1"], ["1:-2"], "not a pair"),
        (["1"], ["1"], "are one"),
        (["-1:-2"], [], "of side 1"),
        ([], ["1"], "no segment is driven"),
    ],
)
def test_wiring_that_cannot_be(keys: list[str], opened: list[str], told: str) -> None:
    with pytest.raises(InputError, match=told.replace("(", r"\(")):
        wiring(Electrodes(1.0, 1.0, segments_1=3, segments_2=2), keys, opened)


def test_too_few_cells() -> None:
    with pytest.raises(InputError, match=r"4 pieces .* give 4 cells or more"):
        strip_netlist(line(1.0, segments_1=4, segments_2=4, cells=3))

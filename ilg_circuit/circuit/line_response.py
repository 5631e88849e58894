"""Solves a line of cells at given frequencies by its nodes, without a circuit, and chooses the number of its cells.

The shunt of a cell is the closed form of its port, so that this costs little and is independent of the netlists of the
other engines. The error of a line falls as 1/N^2 with the number N of its cells: what twice as many cells change is
three quarters of the error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, ComplexArray
from ..strip.actuator import Actuator
from ..strip.cells import Layout, layout, least_cells
from ..strip.elements import Elements, lumped_elements
from .line import sheets_of
from .netlist import GROUND
from .wiring import Wiring, joined

#: Error that a line is to have where the strip gives no number of cells, and the numbers of cells that are tried.
LINE_ERROR = 1e-3
FEWEST, MOST = 10, 80
#: Number of frequencies at which lines are compared, and factor of the error over what twice the cells change.
_FREQUENCIES, _HALVED = 13, 4 / 3
#: Factor by which a number of cells is larger than what the error asks for.
_CAREFUL = 1.05


@dataclass(frozen=True)
class LineResponse:
    """A line under 1 V of each of its sources alone, at ``s`` [rad/s] (f,).

    ``current`` [A] (sources, f) is that of the source; ``mean`` (sources, f) is the mean voltage of the cells, weighted
    by their arms: 1 V where there is no sheet resistance.
    """

    s: ComplexArray
    current: ComplexArray
    mean: ComplexArray


def line_response(
    actuator: Actuator, cells: Layout, wires: Wiring, s: ComplexArray, lumped: Elements, bias: float = 0.0
) -> LineResponse:
    """Return the small-signal response of a line about ``bias`` [V] in every cell, nothing reflected."""
    line = sheets_of(actuator, cells, lumped, wires)
    port = lumped.port.linearised(bias)
    shunt = 1 / port.share(1.0).impedance(s)
    elements = [e for e in line.resolved() if e.kind in "RL"]
    ends = {
        j: tuple(line.node(n) for n in line.ends(j, reflected=False)[:2]) for j, c in enumerate(cells.cells) if c.active
    }
    names = dict.fromkeys(
        [GROUND, *(n for e in elements for n in e.nodes), *(n for pair in ends.values() for n in pair)]
    )
    pins = {pin: line.node(f"{pin}_pin") for pin in line.pins}
    names |= dict.fromkeys(pins.values())
    place = {name: k for k, name in enumerate(names)}
    matrix = np.zeros((len(s), len(names), len(names)), dtype=complex)

    def add(plus: str, minus: str, admittance: ComplexArray) -> None:
        a, b = place[plus], place[minus]
        for row, column, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            matrix[:, row, column] += sign * admittance

    for e in elements:
        add(e.nodes[0], e.nodes[1], 1 / (e.value * (s if e.kind == "L" else np.ones_like(s))))
    for j, (top, end) in ends.items():
        add(top, end, shunt * line.fraction(cells.cells[j]))
    # of a source between two segments one is at 0 V, which is arbitrary where nothing else holds it
    loosened = {*wires.opened} - {minus for _, minus in wires.sources}
    fixed = dict.fromkeys([GROUND, *(node for pin, node in pins.items() if pin not in loosened)])
    held = [place[name] for name in fixed]
    loose = [k for k in range(len(names)) if k not in set(held)]
    levels = np.zeros((len(held), len(wires.sources)))
    for k, (plus, _) in enumerate(wires.sources):
        # pins that float on a driven one follow it
        raised = {*plus, *(pin for of, minus in wires.sources if minus in plus for pin in of)}
        for pin in raised:
            levels[held.index(place[pins[pin]]), k] = 1.0
    voltages = np.zeros((len(s), len(names), len(wires.sources)), dtype=complex)
    voltages[:, held] = levels
    if loose:
        right = -matrix[:, loose][:, :, held] @ levels
        voltages[:, loose] = np.linalg.solve(matrix[:, loose][:, :, loose], right)
    flows = matrix @ voltages
    currents = [
        sum(flows[:, node, k] for node in {place[pins[pin]] for pin in plus})
        for k, (plus, _) in enumerate(wires.sources)
    ]
    mean = sum(
        share * (voltages[:, place[ends[j][0]]] - voltages[:, place[ends[j][1]]]) for j, share in line.shares().items()
    )
    return LineResponse(s, np.array(currents), np.asarray(mean).T)


def chosen_layout(
    actuator: Actuator, band: tuple[float, float], wires: Wiring | None = None, voltage: float = 0.0
) -> tuple[Layout, float]:
    """Return the cells of a strip with electrodes, and their error over ``band`` [Hz] up to a ``voltage`` [V].

    The error is that of each source's current, relative to it, and of the displacement, relative to its largest value
    over the band. The strip's own number of cells is taken where it gives one; else one for an error of `LINE_ERROR`,
    at most `MOST`.
    """
    sheets = actuator.electrodes
    assert sheets is not None
    wires = joined(sheets) if wires is None else wires
    lumped = lumped_elements(actuator, band)
    s: ComplexArray = np.asarray(2j * np.pi * np.geomspace(*band, _FREQUENCIES))
    biases = [0.0] if lumped.port.linear or not voltage else [0.0, voltage]

    def error(cells: Layout) -> float:
        return max(_change(actuator, cells, wires, s, lumped, bias) for bias in biases)

    if sheets.cells is not None:
        given = layout(actuator, int(sheets.cells))
        return given, error(given)
    least = least_cells(actuator)
    count = max(FEWEST, least)
    while True:
        cells = layout(actuator, count, alike=True)
        found = error(cells)
        if found <= LINE_ERROR or count >= max(MOST, least):
            return cells, found
        needed = count * np.sqrt(found / LINE_ERROR) * _CAREFUL
        count = int(min(max(np.ceil(needed), count + 1), max(MOST, least)))


def _change(actuator: Actuator, cells: Layout, wires: Wiring, s: ComplexArray, lumped: Elements, bias: float) -> float:
    """Return the error of a line of ``cells`` against one of twice as many."""
    own, finer = (line_response(actuator, c, wires, s, lumped, bias) for c in (cells, cells.finer()))
    change = float((np.abs(own.current - finer.current) / np.abs(finer.current)).max())
    if lumped.coupling is not None:
        passed = np.abs(_passed(lumped, s))
        moved = passed * np.abs(own.mean - finer.mean)
        scale = (passed * np.abs(finer.mean)).max(axis=1)
        change = max(change, float((moved.max(axis=1) / np.where(scale > 0, scale, np.inf)).max()))
    return _HALVED * change


def _passed(lumped: Elements, s: ComplexArray) -> Array:
    """Return the free displacement of the lumped strip over the voltage across its ion path."""
    return np.array([lumped.coupling_factor(x) / (x * lumped.ion_impedance(x)) for x in s])

"""A strip with electrodes as a line: two sheets, and in each cell the electrical port and the coupling d(s).

    p1 -- lead -- sheet 1: -- R/2 --+-- R/2 --+-- R/2 -- ...        R = R_s dx/w of a cell of length dx
                                  shunt     shunt                    the port of the model for dx/L of the strip
    m1 -- lead -- sheet 2: -- R/2 --+-- R/2 --+-- R/2 -- ...

The two halves between neighbours are one resistor. In each cell of the free length the coupling D(s) makes the
curvature (6/b^2) D(s) x of the voltage across its ion path, or of its charge, so that the free displacement at L_F is
the sum of its arms times these. The arms of all cells add up to L_F^2/2: without sheet resistance the line is the
lumped strip.

A dynamic beam is one for all cells. Since their D(s) is one, it is driven by D(s) of the mean of x by the arms. What
it reflects on cell k, N_k F1, has the arm of the cell: the lumped strip's reflected voltage times the cell's share.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

from ..errors import InputError
from ..strip.actuator import Actuator
from ..strip.cells import Cell, Layout, least_cells
from ..strip.cells import layout as cells_of
from ..strip.electrodes import Electrodes
from ..strip.elements import Elements, lumped_elements
from ..strip.port import Port
from .load import SCALE_NOTE, Load
from .netlist import GROUND, Element, Netlist, Output, Role
from .port import electron_path, ion_path
from .relaxing import transducer
from .strip import tip_motion
from .wiring import Wiring, joined

#: Resistance, over that of the port at high frequencies, below which there is none: rounding would be larger.
_NOTHING = 1e-9
#: Cells of the free length where neither the strip nor the caller says how many.
USUAL_CELLS = 20


def line_netlist(
    actuator: Actuator,
    beam: str,
    tip: str,
    load: Load,
    *,
    band: tuple[float, float],
    rest: float = 0.0,
    wires: Wiring | None = None,
    layout: Layout | None = None,
) -> Netlist:
    """Return the circuit of a strip with electrodes, see `ilg_circuit.circuit.strip.strip_netlist`.

    ``wires`` are by default one source for all segments, ``layout`` is by default that of the strip's number of cells.
    Outputs are current [A] (out of all sources into side 1), charge [C] of all cells, displacement [m], force [N], and
    for each cell of the free length curvature_k [1/m]; for each pin pk of several voltage_k [V] and current_k [A].
    """
    sheets = actuator.electrodes
    assert sheets is not None
    wires = joined(sheets) if wires is None else wires
    if layout is None:
        count = sheets.cells or max(USUAL_CELLS, least_cells(actuator))
        layout = cells_of(actuator, int(count), alike=sheets.cells is None)
    lumped = lumped_elements(actuator, band, load.mass)
    if rest:
        raise InputError("a strip with [electrodes] starts from 0 V; drive it from there")
    if lumped.coupling is None and load:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; a load needs one")
    made = sheets_of(actuator, layout, lumped, wires)
    made.add_cells(beam)
    title = f"ILG strip {actuator.name}, line of {len(layout.free)} cells"
    comments: tuple[str, ...] = ()
    if lumped.coupling is not None:
        made.add_motion(beam, tip, load)
        title = f"{title}, {beam} beam, {tip} tip"
        comments = (SCALE_NOTE,)
    drive, *further = made.drives
    outputs = [*made.terminals(), *made.outputs]
    return Netlist(title, tuple(made.resolved()), tuple(made.named(outputs)), drive, comments, 0.0, tuple(further))


def sheets_of(actuator: Actuator, layout: Layout, lumped: Elements, wires: Wiring) -> Line:
    """Return the sources, leads and sheets of a line, without what is between the sheets."""
    made = Line(actuator, layout, lumped)
    made.add_pins(wires)
    made.add_sheets()
    return made


@dataclass
class Line:
    """A line in the making: elements whose nodes may be one, by ``same``, and outputs."""

    actuator: Actuator
    layout: Layout
    lumped: Elements
    elements: list[Element] = field(default_factory=list)
    outputs: list[Output] = field(default_factory=list)
    same: dict[str, str] = field(default_factory=dict)
    drives: list[str] = field(default_factory=list)
    sensed: list[tuple[str, str]] = field(default_factory=list)
    sources: tuple[tuple[tuple[str, ...], str], ...] = ()
    charge: dict[str, float] = field(default_factory=dict)

    @property
    def port(self) -> Port:
        return self.lumped.port

    @property
    def sheets(self) -> Electrodes:
        assert self.actuator.electrodes is not None
        return self.actuator.electrodes

    @property
    def pins(self) -> list[str]:
        """The pins of all segments, those of side 1 first."""
        return [
            f"{letter}{k}" for side, letter in ((1, "p"), (2, "m")) for k in range(1, self.sheets.segments(side) + 1)
        ]

    def node(self, name: str) -> str:
        """Return the name of a node among those that are one with it."""
        while name in self.same:
            name = self.same[name]
        return name

    def join(self, name: str, into: str) -> None:
        a, b = self.node(name), self.node(into)
        if a != b:
            kept, gone = (a, b) if a == GROUND else (b, a)
            self.same[gone] = kept

    def resistor(self, name: str, plus: str, minus: str, value: float, role: Role = Role.LEAD) -> None:
        """Add a resistor between nodes, or make one of them where it is nothing beside the port's resistance."""
        if value > _NOTHING * self.port.high_frequency_resistance:
            self.elements.append(Element(name, (plus, minus), value, role=role))
        else:
            self.join(plus, minus)

    def add_pins(self, wires: Wiring) -> None:
        """Add the sources, the wires to all pins and the leads from them to the contacts."""
        pins = self.pins
        several = len(wires.sources) > 1
        at = dict.fromkeys(pins, GROUND)
        for k, (plus, minus) in enumerate(wires.sources):
            name, node = (f"Vdrive_{k}", f"drive_{k}") if several else ("Vdrive", "drive")
            self.drives.append(name)
            self.elements.append(Element(name, (node, GROUND), 0.0, role=Role.SOURCE))
            if minus != GROUND:  # a source that floats follows one to ground
                pair = f"pair_{k}"
                self.elements.append(Element(f"Epair_{k}", (pair, f"{minus}_pin", node, GROUND), 1.0, role=Role.SOURCE))
                node = pair
            at |= dict.fromkeys(plus, node)
        for pin in pins:
            wired = f"{pin}_pin"
            if pin in wires.opened:
                self.join(wired, f"{pin}_foil")
                continue
            if pin[0] == "p" or at[pin] != GROUND:
                self.elements.append(Element(f"Vpin_{pin}", (at[pin], wired), 0.0, role=Role.SOURCE))
                self.sensed.append((pin, f"i(Vpin_{pin})"))
            else:
                self.join(wired, GROUND)
            self.add_lead(pin)
        self.sources = wires.sources

    def add_lead(self, pin: str) -> None:
        """Add the wire from a pin to its contact, which on side 1 has the inductance of the leads too."""
        inner = wired = f"{pin}_pin"
        if self.port.inductance and pin[0] == "p":
            inner = f"{pin}_lead"
            self.elements.append(Element(f"Lseries_{pin}_", (wired, inner), self.port.inductance, role=Role.LEAD))
        self.resistor(f"Rlead_{pin}_", inner, f"{pin}_foil", self.sheets.lead_resistance)

    def add_leads(self) -> None:
        """Add the wires of all pins, and no source."""
        for pin in self.pins:
            self.add_lead(pin)

    def add_sheets(self) -> None:
        """Add the sheets' resistors from contact to cell to cell, and the leaks across gaps."""
        sheets = self.sheets
        for side, letter, squares in ((1, "p", sheets.sheet_resistance_1), (2, "m", sheets.sheet_resistance_2)):
            per_length = squares / self.actuator.geometry.width
            last: str = GROUND
            for k, contact in enumerate(self.layout.contacts[side - 1]):
                points = [(contact, f"{letter}{k + 1}_foil")]
                for j, cell in enumerate(self.layout.cells):
                    if cell.active and cell.segments[side - 1] == k:
                        if cell.contact:
                            self.join(_foil(letter, j), points[0][1])
                        else:
                            points.append((cell.middle, _foil(letter, j)))
                points.sort(key=lambda point: point[0])
                for n, ((a, left), (b, right)) in enumerate(pairwise(points)):
                    self.resistor(f"Rsheet{side}_{k + 1}x{n}_", left, right, per_length * (b - a))
                if k and sheets.gap_resistance is not None:
                    self.resistor(f"Rgap{side}_{k}_", last, points[0][1], sheets.gap_resistance)
                last = points[-1][1]

    def shares(self) -> dict[int, float]:
        """Return each cell's share of the displacement at L_F per curvature, by its place; they add up to one."""
        at = self.actuator.geometry.load_distance
        arms = {j: cell.arm(at) for j, cell in enumerate(self.layout.cells) if cell.active}
        return {j: arm / (at**2 / 2) for j, arm in arms.items() if arm}

    def add_cells(self, beam: str) -> None:
        """Add the port of every cell with electrodes; of a dynamic beam with its reflected voltage."""
        shares = self.shares() if beam == "dynamic" and self.lumped.coupling is not None else {}
        for j, cell in enumerate(self.layout.cells):
            if cell.active:
                port, (top, end, back) = self.share(cell), self.ends(j, reflected=j in shares)
                self.elements.append(electron_path(port, top, end, _suffix(j)))
                ions, charge = ion_path(port, top, back, _suffix(j))
                self.elements += ions
                for quantity, c in charge.items():
                    self.charge[quantity] = self.charge.get(quantity, 0.0) + c

    def fraction(self, cell: Cell) -> float:
        return cell.length / self.actuator.geometry.length

    def share(self, cell: Cell) -> Port:
        """Return the port of a cell."""
        return self.port.share(self.fraction(cell))

    def ends(self, j: int, *, reflected: bool) -> tuple[str, str, str]:
        """Return the nodes of a cell on side 1 and 2, and the one where its ion path ends."""
        top, end = _foil("p", j), _foil("m", j)
        return top, end, f"back_{j}_" if reflected else end

    def add_filter(self, j: int, *, reflected: bool = False) -> dict[str, float]:
        """Add the filter of a cell's coupling; return D(s) x in it [m], as coefficients of node voltages."""
        top, _, back = self.ends(j, reflected=reflected)
        elements, moved = transducer(self.lumped).cell(self.share(self.layout.cells[j]), _suffix(j), top, back)
        self.elements += elements
        return moved

    def add_motion(self, beam: str, tip: str, load: Load) -> None:
        """Add the curvature of every cell of the free length, and the tip's motion."""
        wired = transducer(self.lumped)
        thickness, shares, dynamic = self.actuator.geometry.thickness, self.shares(), beam == "dynamic"
        displacement: dict[str, float] = {}
        curvatures: list[Output] = []
        backs = []
        for j, cell in enumerate(self.layout.cells):
            if not cell.free:
                continue
            terms: dict[str, float] = {}
            if cell.active:
                terms = self.add_filter(j, reflected=dynamic and j in shares)
                displacement |= {q: self.lumped.bending_ratio * shares.get(j, 0.0) * c for q, c in terms.items()}
                terms = {q: 6 / thickness**2 * c for q, c in terms.items()}
                if dynamic and j in shares:
                    top, end, back = self.ends(j, reflected=True)
                    mean = (GROUND, "mean", wired.driven(f"d{_suffix(j)}"), GROUND)
                    self.elements.append(Element(f"Gmean{_suffix(j)}", mean, shares[j], role=Role.COUPLING_FILTER))
                    self.elements += wired.direct_velocity(self.share(cell), _suffix(j), top, shares[j])
                    # N_k = (arm per length) over that of the lumped strip, which its whole length shares
                    gain = shares[j] / self.fraction(cell)
                    backs.append(
                        Element(f"Eback{_suffix(j)}", (back, end, "copy", GROUND), gain, role=Role.REFLECTED_VOLTAGE)
                    )
            curvatures.append(Output(f"curvature_{len(curvatures) + 1}", "1/m", tuple(terms.items()), probe=True))
        if dynamic:
            self.elements.append(Element("Rmean", ("mean", GROUND), 1.0, role=Role.COUPLING_FILTER))
            self.elements += wired.averaged()
            displacement = wired.displacement()
        moving, motion = tip_motion(self.lumped, wired, displacement, backs, beam, tip, load)
        self.elements += moving
        self.outputs += [*motion, *curvatures]

    def terminals(self) -> list[Output]:
        """Return current and charge, and voltage and current of each segment where there are several."""
        driven = {pin for plus, _ in self.sources for pin in plus}
        currents = [(q, 1.0 if pin[0] == "p" else -1.0) for pin, q in self.sensed if pin in driven]
        found = [Output("current", "A", tuple(currents)), Output("charge", "C", tuple(self.charge.items()))]
        if len(self.drives) > 1 or "m" in {pin[0] for pin in driven}:
            for k, (plus, _) in enumerate(self.sources):
                terms = tuple((f"i(Vpin_{pin})", 1.0) for pin in plus)
                found.append(Output(f"delivered_{k}", "A", terms, probe=True))
        if self.sheets.segments(1) > 1:
            sensed = dict(self.sensed)
            for k in range(1, self.sheets.segments(1) + 1):
                pin = f"p{k}"
                found.append(Output(f"voltage_{k}", "V", ((f"v({pin}_pin)", 1.0),), probe=True))
                current = ((sensed[pin], 1.0),) if pin in sensed else ()
                found.append(Output(f"current_{k}", "A", current, probe=True))
        return found

    def resolved(self) -> list[Element]:
        """Return the elements, nodes that are one by one name; those between one node and itself left out."""
        found = []
        for element in self.elements:
            nodes = tuple(self.node(name) for name in element.nodes)
            if element.kind in "RLCB" and nodes[0] == nodes[1]:
                raise InputError(
                    "a segment of side 1 is joined with one of side 2 without resistance: a source would be shorted"
                )
            found.append(replace(element, nodes=nodes))
        return found

    def named(self, outputs: list[Output]) -> list[Output]:
        """Return the outputs with the names of nodes that are one; ground has no voltage."""
        found = []
        for output in outputs:
            terms: dict[str, float] = {}
            for quantity, c in output.terms:
                if quantity[0] == "v":
                    node = self.node(quantity[2:-1])
                    if node == GROUND:
                        continue
                    quantity = f"v({node})"
                terms[quantity] = terms.get(quantity, 0.0) + c
            found.append(replace(output, terms=tuple(terms.items())))
        return found


def _suffix(j: int) -> str:
    """Return what the names of elements and nodes of cell ``j`` end with, before a number of their own."""
    return f"_{j}_"


def _foil(letter: str, j: int) -> str:
    """Return the node of cell ``j`` on sheet 1 (p) or 2 (m)."""
    return f"{letter}foil_{j}_"

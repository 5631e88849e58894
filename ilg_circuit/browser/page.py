"""A strip and a drive -> one HTML file, which opens from disk, needs no network, and solves the strip by itself.

The page holds the strip's subcircuit (`circuit.library`) and changes its parameters only. It also holds what the
package itself computes of the strip as it is, so that every reader's browser measures its own agreement with that.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..arrays import Array
from ..circuit.library import HEAVIER, library, library_netlist
from ..circuit.netlist import Role
from ..circuit.provenance import FIRST_STEP, LONGEST_STEP, TIGHT_OPTIONS
from ..drive import NETLIST_RISE, Drive, require_voltage
from ..errors import InputError, argument, visible
from ..provenance import Provenance
from ..simulation.drives import parse_drive, two
from ..simulation.impedance import frequencies, impedance
from ..simulation.response import simulate
from ..solve.library import available
from ..strip.actuator import Actuator
from ..strip.elements import gravity_ratio, lumped_elements
from ..units import format_quantity, parse
from .assets import assets
from .sliders import sliders

#: Drives that a page has, by the name in their text.
KINDS = ("step", "square", "sine", "triangle")
#: Periods that a page draws at most: more would keep its reader waiting.
MOST_PERIODS = 20
#: The agreement that a page asks of itself, relative to the largest value.
CLOSE = 1e-5
#: Frequencies of the impedance [Hz], and how many a decade.
_BAND, _A_DECADE = (1e-3, 1e3), 10
#: Times at which native results stand in the page.
_NATIVE = 120
_SCRIPTS = ("deck.js", "measured.js", "plots.js", "results.js", "solver.js", "main.js")


@dataclass(frozen=True)
class PageDrive:
    """A drive as a page knows it: its ``kind``, its levels [V], and what its period has, SI units."""

    kind: str
    duration: float
    high: float = 4.0
    low: float = 0.0
    amplitude: float = 2.0
    frequency: float = 0.1
    period: float = 20.0
    duty: float = 0.5

    @property
    def periods(self) -> float:
        """Return how many there are in the duration; 0 of a step."""
        return {"step": 0.0, "sine": self.duration * self.frequency}.get(self.kind, self.duration / self.period)


def page_drive(text: str, duration: float) -> PageDrive:
    """Return the drive of a ``text`` over a ``duration`` [s].

    Raises
    ------
    InputError
        A page has no such drive, or the duration has too many of its periods.
    """
    if not duration > 0:
        raise InputError(f"duration {format_quantity(duration, 's')} must be more than zero")
    require_voltage(parse_drive(text, duration), "a page")  # which says what is wrong with it
    kind, _, rest = text.partition(":")
    if kind not in KINDS:
        allowed = ", ".join(KINDS)
        raise InputError(f"a page has the drives {allowed}, not '{visible(kind)}'; drop a file on it for others")
    first, *others = (part.strip() for part in rest.split(","))
    known: dict[str, float] = {"period": duration / 5, "frequency": 5 / duration}
    if kind == "step":
        known["high"] = parse(first, "V", kind)
    elif kind == "sine":
        known |= {"amplitude": parse(first, "V", kind), "frequency": parse(others[0], "Hz", kind)}
    else:
        low, high = two(first, "V", kind)
        known |= {"low": low, "high": high, "period": parse(others[0], "s", kind)}
        if len(others) > 1:
            known["duty"] = parse(others[1], "", kind)
    made = PageDrive(kind, duration, **known)
    if made.periods > MOST_PERIODS * (1 + 1e-9):
        longest = format_quantity(MOST_PERIODS * duration / made.periods, "s", 4)
        raise InputError(
            f"{visible(text)} has {made.periods:.4g} periods in {format_quantity(duration, 's')}; a page draws at most "
            f"{MOST_PERIODS}: give {argument('duration', longest.replace(' ', ''))} or less"
        )
    return made


def strip_page(
    actuator: Actuator, drive: str, duration: float, beam: str | None = None, origin: Provenance | None = None
) -> str:
    """Return the page of a strip that begins with a ``drive`` over ``duration`` [s].

    ``beam`` as for its library.

    Raises
    ------
    InputError
        A page has no such drive.
    MissingLibraryError
        The files that npm fetches are not there.
    SolveError
        The strip cannot be solved.
    """
    made = page_drive(drive, duration)
    carried = assets()
    content = _content(actuator, made, parse_drive(drive, duration), actuator.beam(beam), origin or Provenance())
    room = Path(__file__).parent

    def source(name: str) -> str:
        return (room / name).read_text(encoding="utf-8")

    from jinja2 import Environment

    template = Environment(autoescape=True, keep_trailing_newline=True).from_string(source("page.html.j2"))
    return template.render(
        name=visible(actuator.name),
        version=__version__,
        data=_in_script(json.dumps(content, allow_nan=False)),
        program=carried.program,
        worker=_in_script(json.dumps(carried.loader + source("engine.js"))),
        scripts=[carried.plot, *map(source, _SCRIPTS)],
        styles=[carried.plot_style, source("page.css")],
        licences=carried.licences,
        coupled=actuator.coupling is not None,
        warnings=content["native"]["warnings"],
    )


def _in_script(text: str) -> str:
    """Return JSON that may stand in a script element."""
    return text.replace("<", "\\u003c")


def _content(actuator: Actuator, made: PageDrive, drive: Drive, beam: str, origin: Provenance) -> dict[str, Any]:
    """What the page's scripts are told, SI units."""
    ladder = lumped_elements(actuator).port.ladder
    moved = sorted(set(actuator.material.model.ions.library_parameters) - {"dynamic_resistivity", "permittivity"})
    hanging = actuator.coupling is not None and actuator.mounting.orientation == "hanging"
    return {
        "name": visible(actuator.name),
        "program": f"ilg_circuit {__version__}",
        "origin": origin.lines(),
        "coupled": actuator.coupling is not None,
        "library": library(actuator, beam=beam),
        "charge": _charge(actuator, beam),
        "sliders": [asdict(slider) for slider in sliders(actuator, beam)],
        "drive": asdict(made),
        "mostPeriods": MOST_PERIODS,
        "rise": NETLIST_RISE,
        "options": TIGHT_OPTIONS,
        "longest": LONGEST_STEP,
        "first": FIRST_STEP,
        "band": [*_BAND, _A_DECADE],
        "close": CLOSE,
        "gravity": {"ratio": gravity_ratio(actuator), "heavier": HEAVIER} if hanging else None,
        "ladder": {"band": ladder.band, "moved": moved} if ladder is not None else None,
        "native": _native(actuator, drive, made.duration, beam),
    }


def _charge(actuator: Actuator, beam: str) -> list[dict[str, str]]:
    """The nodes whose voltages times a capacitor's value are the charge; no capacitor where it is the charge itself."""
    netlist = library_netlist(actuator, beam)
    capacitors = {e.nodes[0]: e.name.lower() for e in netlist.elements if e.kind == "C" and e.role is Role.ION_PATH}
    (terms,) = (output.terms for output in netlist.outputs if output.name == "charge")
    nodes = [quantity[2:-1] for quantity, _ in terms]
    return [{"node": node, "capacitor": capacitors.get(node, "")} for node in nodes]


def _native(actuator: Actuator, drive: Drive, duration: float, beam: str) -> dict[str, Any]:
    """What the package computes of the strip as it is, by its own ngspice; exactly where there is none."""
    engine = "exact" if actuator.linear and not available() else "ngspice"
    times = (np.arange(_NATIVE) + 0.5) / _NATIVE * duration
    edges = drive.breakpoints(duration)
    if len(edges):
        times = times[np.abs(times[:, None] - edges).min(axis=1) > 1e-3 * duration]
    free = simulate(actuator, drive, times, beam=beam, engine=engine)
    spectrum = impedance(actuator, frequencies(*_BAND), beam=beam, engine="exact").impedance
    found: dict[str, Array] = {"time": times, "current": free.current, "charge": free.charge}
    if actuator.coupling is not None:
        held = simulate(actuator, drive, times, beam=beam, tip="clamped", engine=engine)
        found |= {"displacement": free.displacement, "force": held.force}
    found |= {"re": spectrum.real, "im": spectrum.imag}
    return {"engine": engine, "warnings": free.warnings, "values": {name: x.tolist() for name, x in found.items()}}

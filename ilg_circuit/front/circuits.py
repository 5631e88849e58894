"""The strip as a circuit, for other programs and for circuits of a user's own."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ..circuit.deck import deck
from ..circuit.library import library as write_library
from ..circuit.library import library_netlist, pinned
from ..circuit.line_library import line_library
from ..circuit.load import Hung
from ..circuit.netlist import add_elements
from ..circuit.strip import strip_netlist
from ..circuit.text import DECK, SUBCIRCUIT, SpiceText
from ..drive import by_current, drive_findings, require_voltage, voltage_limit
from ..errors import InputError, SolveError, checked
from ..findings import sentences
from ..provenance import Provenance
from ..simulation.response import line_of, transient_band
from ..solve.library import prepare_library
from ..strip.electrodes import require_lump
from .given import Driven, Given, Segmented, Strip, mounted, run_of, wired_run
from .given import load as strip_of

if TYPE_CHECKING:
    from PySpice.Spice.Netlist import SubCircuit


@checked
def netlist(
    strip: Strip,
    drive: Driven | Segmented,
    duration: Given | None = None,
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
) -> SpiceText:
    """Return a SPICE deck of a strip under a drive, which ``ngspice -b`` runs as it is.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    drive : str, Drive, (times, values) or mapping
        Voltage over time, or those of the segments, as in `simulate`.
    duration : float or str
        Duration [s]; not needed if the drive is a pair of arrays.
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".

    Returns
    -------
    SpiceText
        The deck, which is a str with ``save("strip.cir")`` and ``warnings`` on the drive.

    Raises
    ------
    InputError
        A value is not understood or out of range.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> deck = ilg.netlist("paper", "step:4V", "300 s")
    >>> deck
    <SPICE deck of 52 lines: ILG strip paper, dynamic beam, free tip; print it, or save it as .cir>
    >>> deck.splitlines()[-1]
    '.end'
    """
    actuator = strip_of(strip)
    source, times, wires = wired_run(actuator, drive, duration)
    if voltage_limit(source) is not None:
        raise InputError("a deck has no limit of its source of current; leave limit= out, or add a clamp to the deck")
    line, _ = line_of(actuator, transient_band(times), wires, source.largest())
    circuit = strip_netlist(actuator, **mounted(tip, beam, load), by_current=by_current(source), **line)
    text = deck(circuit, source, float(times[-1]), actuator)
    return SpiceText(text, DECK, sentences(drive_findings(source)))


@checked
def library(strip: Strip, name: str | None = None, *, beam: str | None = None) -> SpiceText:
    """Return a strip as the text of a SPICE subcircuit with parameters: pins plus, minus and, with a coupling, tip.

    One with electrodes has the pins p1 m1 p2 m2 ... of all segments, and numbers in place of parameters. Its curvatures
    (1 V = 1/m) are the inner nodes k1, k2, ..., the free end's angle (1 V = 1 rad), x and y (1 V = 1 mm) those of these
    names.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    name : str, optional
        Name of the subcircuit (default: "ilg_strip", with electrodes "ilg_strip_4" for four segments).
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).

    Returns
    -------
    SpiceText
        The subcircuit, which is a str with ``save("strip.lib")``.

    Raises
    ------
    InputError
        SPICE would not take the name.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ".subckt gripper plus minus tip" in ilg.library("paper", "gripper")
    True
    """
    actuator = strip_of(strip)
    if actuator.electrodes is not None:
        return SpiceText(line_library(actuator, name, beam), SUBCIRCUIT)
    return SpiceText(write_library(actuator, "ilg_strip" if name is None else name, beam), SUBCIRCUIT)


@checked
def subcircuit(strip: Strip, name: str = "ilg_strip", *, beam: str | None = None) -> SubCircuit:
    """Return a strip as a PySpice subcircuit, for a circuit of one's own.

    Its pins are plus and minus and, with a coupling, tip. The voltage from tip to ground is the force on the load (1 V
    is 1 uN) and the current out of tip is the velocity (1 A is 1 mm/s): ground the pin for a free tip, leave it open
    for a clamped one. The voltage of the inner node ``way`` is the tip's displacement (1 V is 1 mm): ``x1.way`` of
    an instance named "1".

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    name : str
        Name of the subcircuit.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).

    Returns
    -------
    PySpice.Spice.Netlist.SubCircuit
        The strip between its pins.

    Raises
    ------
    InputError
        SPICE would not take the name.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> from PySpice.Spice.Netlist import Circuit
    >>> circuit = Circuit("driver")
    >>> circuit.subcircuit(ilg.subcircuit("paper"))
    >>> source = circuit.V("supply", "out", circuit.gnd, 4)
    >>> strip = circuit.X("1", "ilg_strip", "out", circuit.gnd, circuit.gnd)
    >>> analysis = circuit.simulator().transient(step_time=1, end_time=300, use_initial_condition=True)
    >>> f"{float(analysis['x1.way'][-1]):.2f} mm"
    '3.98 mm'
    """
    with suppress(SolveError):  # the circuit may be meant for another program
        prepare_library()  # for PySpice's own simulators
    from PySpice.Spice.Netlist import SubCircuit

    actuator = strip_of(strip)
    require_lump(actuator, "a PySpice subcircuit")
    pins, elements = pinned(actuator, name, library_netlist(actuator, beam))
    made = SubCircuit(name, *pins)
    add_elements(made, elements)
    return made


@checked
def kit(
    strip: Strip,
    folder: str | Path,
    drive: Driven = "step:4V",
    duration: Given | None = "300 s",
    *,
    beam: str | None = None,
    force: bool = False,
    origin: Provenance | None = None,
) -> Path:
    """Write a strip as a folder for who builds its driver: a library, symbols, decks that run as they are, a page.

    The library has the pins plus, minus, tip and position (1 V = 1 mm). The decks are an operating point, a spectrum,
    the drive, an H-bridge, an amplifier with a current limit, a position loop and its loop gain; of a fitted strip also
    corners and a Monte Carlo from the fit's covariance. README.md in the folder says how to use each.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name; it has a coupling.
    folder : str or Path
        The folder to write, whole or not at all; one that is there is replaced if it is a kit with nothing added.
    drive : str, Drive or (times, values)
        Voltage over time of the transients, as in `simulate`; the other decks take its largest voltage.
    duration : float or str
        How long [s].
    beam : {"dynamic", "static"}, optional
        With the beam's mass or without it, as the library's default (default: as the coupling was fitted).
    force : bool
        Whether to replace a folder that holds something else.
    origin : Provenance, optional
        Where it comes from, for the page.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    InputError
        A value is not understood, the strip has no coupling, or the folder is not to be replaced.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     made = ilg.kit("paper", f"{place}/kit", "step:4V", "100 s")
    ...     sorted(file.name for file in made.glob("*.cir"))[:3]
    ['ac.cir', 'amplifier.cir', 'h_bridge.cir']
    """
    from ..kits.folder import write_kit

    path = Path(folder)
    read = [Path(given.removeprefix("file:")) for given in (strip, drive) if isinstance(given, str)]
    read += [strip] if isinstance(strip, Path) else []
    actuator = strip_of(strip)
    require_lump(actuator, "a kit")
    source, times = run_of(drive, duration)
    require_voltage(source, "a kit")
    write_kit(path, actuator, source, float(times[-1]), beam, origin=origin, force=force, inputs=read)
    return path

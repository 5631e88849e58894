"""A strip's elements wired up: electrical port, coupling d(s), transformer, beam and load. EC (10)-(19), Figure 5.

The mechanical side uses the impedance analogy (force = voltage, velocity = current) in units of its own, because its
numbers are far below SPICE's tolerances: 1 V is 1 uN, 1 A is 1 mm/s, so 1 C is 1 mm. Signs are positive towards the
anode, the opposite of EC's axis.

``d(s)`` of EC (31) is a series R-L-C with C = 1 F: driven by a voltage v, d(s) v = d0 [v_C + i/(Zd C)], and s d(s) v is
d0 [v_L/(Zd L C) + i/C], so nothing is ever differentiated. The transformer is then

    free velocity      v1 = N i1 = k s d(s) v_p             v_p across the ionic branches, k = 3 L_F^2/b^2
    reflected voltage  u1 = N F1 = Zp k s d(s) F1           a current k s d(s) F1 through a copy of the branches

Other couplings, which relax, are in `ilg_circuit.circuit.relaxing`.
"""

from __future__ import annotations

from typing import Any

from ..errors import InputError, argument
from ..strip.actuator import Actuator
from ..strip.electrodes import require_lump
from ..strip.elements import Elements, lumped_elements
from ..strip.ladder import LADDER_BAND
from ..strip.port import Port
from .coupling import BACK, Transducer
from .load import FORCE_SCALE, IMPEDANCE_SCALE, SCALE_NOTE, VELOCITY_SCALE, Load, tip_elements
from .netlist import GROUND, Element, Netlist, Output, Role, series_sum
from .port import DRIVE, driven_port, electron_path, port_elements, port_node
from .relaxing import transducer
from .sensing import sensing_elements


def electrical_netlist(
    dc_resistance: float,
    branches: tuple[tuple[float, float], ...],
    electrode_resistance: float = 0.0,
    title: str = "ILG strip, electrical port",
) -> Netlist:
    """Return the port alone: Re in series with Rdc parallel to R-C branches, Figure 4; outputs current and charge.

    ``branches`` are (resistance [ohm], capacitance [F]) pairs.
    """
    return port_netlist(Port(dc_resistance, tuple(branches), electrode_resistance), title)


def port_netlist(
    port: Port, title: str = "ILG strip, electrical port", rest: float = 0.0, *, by_current: bool = False
) -> Netlist:
    """Return the electrical port alone, of any model; outputs current [A] and charge [C] on the ion path.

    A nonlinear one starts at rest under ``rest`` [V]. ``by_current``: as for `strip_netlist`.
    """
    rest = 0.0 if port.linear else rest
    elements, outputs = driven_port(port, GROUND, port.inner_voltage(rest), by_current=by_current)
    return Netlist(title, tuple(elements), tuple(outputs), rest=rest)


def electron_netlist(port: Port, title: str = "ILG strip, electron path", rest: float = 0.0) -> Netlist:
    """Return the electron path of a port alone, straight across the source; output: its current [A]."""
    current = Output("current", "A", ((f"i({DRIVE.name})", -1.0),))
    return Netlist(title, (DRIVE, electron_path(port, *DRIVE.nodes)), (current,), rest=rest)


def strip_netlist(
    actuator: Actuator,
    *,
    tip: str = "free",
    beam: str | None = None,
    load: Load | None = None,
    band: tuple[float, float] = LADDER_BAND,
    rest: float = 0.0,
    by_current: bool = False,
    **line: Any,
) -> Netlist:
    """Return the whole strip; outputs: current [A], charge [C], displacement [m] and force [N] (at L_F, on the load).

    ``beam`` "dynamic" is the port EC (17) without simplification: beam compliance and mass, voltage reflected onto the
    electrical side. "static" is EC (26), (29): no mass, nothing reflected. None is the strip's own, `Actuator.beam`.
    ``tip`` "clamped" holds the point L_F. ``band`` [Hz] is a ladder's, if the strip gives none. A nonlinear
    strip starts at rest under ``rest`` [V]. ``by_current``: the drive is a current [A], and the voltage [V] a further
    output. One with electrodes is a line, see `ilg_circuit.circuit.line`, with the further arguments of `line_netlist`.
    Raises InputError for an unknown word, a load where there can be none, or a
    hanging strip that is nothing beside its weight.
    """
    load = load or Load()
    beam = actuator.beam(beam, loaded=bool(load))
    if tip not in ("free", "clamped"):
        raise InputError(f"tip is '{tip}'; choose free or clamped")
    if beam not in ("dynamic", "static"):
        raise InputError(f"beam is '{beam}'; choose dynamic or static")
    if load and (tip == "clamped" or beam == "static"):
        raise InputError(
            f"a load moves with the tip: it needs {argument('tip', 'free')} and {argument('beam', 'dynamic')}"
        )
    if actuator.electrodes is not None:
        from .line import line_netlist

        if by_current:
            raise InputError("a strip with [electrodes] is driven by voltages; a current has no one pair of terminals")
        return line_netlist(actuator, beam, tip, load, band=band, rest=rest, **line)
    if line:
        raise InputError(f"actuator '{actuator.name}' has no [electrodes]; it is one lump with one pair of terminals")
    lumped = lumped_elements(actuator, band, load.mass)
    title = f"ILG strip {actuator.name}, {beam} beam, {tip} tip"
    port = lumped.port
    if lumped.coupling is None:
        if load:
            raise InputError(f"actuator '{actuator.name}' has no [coupling]; a load needs one")
        return port_netlist(port, title, rest, by_current=by_current)
    rest = 0.0 if actuator.linear else rest
    if rest and load:
        raise InputError(f"a strip that starts at rest under {rest:g} V has no load; leave one of them out")
    inner = port.inner_voltage(rest)
    back = GROUND if beam == "static" else "back"
    elements, outputs = driven_port(port, back, inner, by_current=by_current)
    wired = transducer(lumped)
    elements += wired.filter(back, inner)
    free = wired.displacement()
    moving, motion = tip_motion(lumped, wired, free, [BACK], beam, tip, load)
    if beam == "dynamic":
        moving = [*wired.direct_velocity(port, "", port_node(port)), *moving]
    outputs += motion
    moved = tuple((q, c / VELOCITY_SCALE) for q, c in free.items()) if beam == "dynamic" else ()
    return Netlist(title, (*elements, *moving), tuple(outputs), comments=(SCALE_NOTE,), rest=rest, free=moved)


def tip_motion(
    lumped: Elements,
    wired: Transducer,
    displacement: dict[str, float],
    backs: list[Element],
    beam: str,
    tip: str,
    load: Load,
) -> tuple[list[Element], list[Output]]:
    """Return the beam and the tip, and the outputs displacement and force.

    ``displacement`` is the free one, as coefficients of node voltages. A dynamic beam has the filter ``d``, and makes
    the reflected voltage of the lumped strip at node ``copy``, which ``backs`` put in series with ion paths.
    """
    elements: list[Element] = []
    force = dict.fromkeys(displacement, 0.0)
    if beam == "dynamic":
        # electrical -> mechanical: v1 = k s d(s) v_p flows into the beam's compliance
        elements += wired.velocity()
        elements.append(Element("Cbeam", ("beam", GROUND), 1 / (lumped.stiffness * IMPEDANCE_SCALE), role=Role.BEAM))
        elements += [*wired.voltage(), *backs]
        # the tip moves by what the strip wants less what its compliance takes up: y = y1 - F1/K
        displacement = displacement | {"v(beam)": -FORCE_SCALE / lumped.stiffness}
        force = {"v(beam)": FORCE_SCALE}
        if tip == "free":
            meshed, force = tip_elements(lumped, load)
            elements += meshed
        else:
            displacement = {"v(beam)": 0.0}
    elif tip == "clamped":
        force = {q: c * lumped.stiffness for q, c in displacement.items()}
        displacement = dict.fromkeys(displacement, 0.0)
    else:
        displacement = {q: c * lumped.hanging_share for q, c in displacement.items()}
    return elements, _motion(displacement, force)


def _motion(displacement: dict[str, float], force: dict[str, float]) -> list[Output]:
    """Return the mechanical outputs, from their terms."""
    return [Output("displacement", "m", tuple(displacement.items())), Output("force", "N", tuple(force.items()))]


def sensor_netlist(actuator: Actuator, *, terminals: str = "open", band: tuple[float, float] = LADDER_BAND) -> Netlist:
    """Return the strip as a sensor: the point L_F is moved; ``terminals`` are "open" or "short".

    The signal is that of its [sensing], or else reciprocal, EC (17) inverted.

    The drive is the displacement y of L_F in metres (1 V = 1 m). Outputs: voltage [V] at open terminals or current [A]
    into the strip's plus pin at shorted ones, charge [C], displacement [m], and the elastic force [N] of the strip at
    L_F, K (y1 - y); its own mass is the mover's affair. Raises InputError for an unknown word, or a strip without
    coupling.
    """
    if terminals not in ("open", "short"):
        raise InputError(f"terminals are '{terminals}'; choose open or short")
    require_lump(actuator, "sensing")
    lumped = lumped_elements(actuator, band)
    if lumped.coupling is None and actuator.sensing is None:
        raise InputError(f"actuator '{actuator.name}' has no [coupling]; it cannot sense without it or a [sensing]")
    node = port_node(lumped.port)
    shorted = Element("Vshort", ("drive", GROUND), 0.0, role=Role.SOURCE) if terminals == "short" else None
    elements, outputs = port_elements(lumped.port, "back", shorted)
    elements.insert(0, Element("Vmotion", ("motion", GROUND), 0.0, role=Role.SOURCE))
    wired = transducer(lumped) if lumped.coupling is not None else None
    elements += wired.filter("back") if wired is not None else []
    # the force on a beam whose tip is held at y: F1 = K (y1 - y), a sum of sources in series
    elastic = {q: c * lumped.stiffness for q, c in wired.displacement().items()} if wired is not None else {}
    elastic["v(motion)"] = -lumped.stiffness
    elements += series_sum("beam", [(quantity, gain / FORCE_SCALE) for quantity, gain in elastic.items()])
    if actuator.sensing is not None:
        elements += sensing_elements(actuator.sensing, lumped, actuator.geometry)
    elif wired is not None:
        elements += wired.reflection()
    if terminals == "open":
        # without a source nothing ties the terminal down but the strip itself
        outputs.insert(0, Output("voltage", "V", ((f"v({node})", 1.0),)))
    outputs += _motion({"v(motion)": 1.0}, {"v(beam)": FORCE_SCALE})
    title = f"ILG strip {actuator.name}, sensor, {terminals} terminals"
    return Netlist(title, tuple(_without_dangling(elements)), tuple(outputs), drive="Vmotion", comments=(SCALE_NOTE,))


def _without_dangling(elements: list[Element]) -> list[Element]:
    """Return the elements without leads that end unconnected at open terminals."""
    ends = [n for e in elements if e.role is not Role.LEAD for n in e.nodes]
    return [e for e in elements if e.role is not Role.LEAD or "drive" in ends]

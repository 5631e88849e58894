"""Decks of a kit for the strip alone: operating point, spectrum, transient. Each includes ``strip.lib``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..circuit.deck import transient_lines
from ..circuit.netlist import plain
from ..circuit.provenance import LONGEST_STEP, TIGHT_OPTIONS, folded
from ..circuit.strip import strip_netlist
from ..drive import Drive
from ..errors import InputError
from ..solve.spectrum import spectrum
from ..strip.actuator import Actuator
from ..units import format_quantity
from .loop import Loop, pi_loop, position_per_volt, rounded
from .subcircuit import NAME

#: Rows of a transient's table, at least.
_ROWS = 601
#: The set-point of the position loop in parts of what the drive's largest voltage moves at rest.
_REACH = 0.75
#: The current limit of the amplifier in parts of what a step of that voltage wants at first.
_LIMITED = 0.5
#: Frequencies of the spectrum in parts of that of d(s), and points a decade.
_FROM, _DECADES, _A_DECADE = 0.03, 6, 10


@dataclass(frozen=True)
class Plan:
    """What the decks of a kit are made from: a strip, its ``drive`` over ``duration`` [s], and what follows from them.

    ``level`` [V] is the drive's largest voltage, ``position`` [mm] where it puts the tip, ``current`` [A] what a step
    of it wants at first; ``current_limit`` [A] is the amplifier's, ``loop`` the position controller.
    """

    actuator: Actuator
    drive: Drive
    duration: float
    level: float
    position: float
    current: float
    current_limit: float
    loop: Loop
    lowest: float

    @property
    def highest(self) -> float:
        """The highest frequency [Hz] of the spectrum; ``lowest`` is the lowest."""
        return self.lowest * 10.0**_DECADES


def plan(actuator: Actuator, drive: Drive, duration: float, beam: str | None = None) -> Plan:
    """Return what the decks of a kit are made from. Raises InputError for a drive without a voltage."""
    assert actuator.coupling is not None
    level = drive.largest()
    if not level > 0:
        raise InputError("a kit needs a drive of more than 0 V: its decks take their voltage from it")
    if not actuator.coupling.rate:
        raise InputError(
            f"the coupling of '{actuator.name}' is instantaneous alone, which gives a kit's loop no time constant; "
            "give it a gain_1 with a time_1"
        )
    rate = actuator.coupling.rate / (2 * np.pi)
    position = level * float(position_per_volt(actuator, np.array([1e-6 * rate]), beam)[0].real)
    admittance = spectrum(strip_netlist(actuator, beam=beam), [1e4 * rate], engine="exact").output("current")[0]
    current = level * float(abs(admittance))
    loop = pi_loop(actuator, level, rounded(_REACH * position), beam)
    lowest = 10.0 ** np.floor(np.log10(_FROM * rate))
    limit = rounded(_LIMITED * current)
    return Plan(actuator, drive, duration, level, position, current, limit, loop, float(lowest))


def operating_point(made: Plan) -> str:
    """Return the deck of .op under the drive's largest voltage."""
    level = format_quantity(made.level, "V", 6)
    return finished(
        f"Operating point of the strip at {level}",
        ["v(position) is the position, 1 V = 1 mm; i(vsense) the current into the strip"],
        [f"Vdrive drive 0 {made.level!r}", *STRIP, TIGHT_OPTIONS, ".print op v(position) i(Vsense)", ".op"],
    )


def small_signal(made: Plan) -> str:
    """Return the deck of .ac: admittance, and position per volt."""
    return finished(
        "Small signals of the strip: its admittance, and its position per volt",
        [
            "1/(ir + j ii) of vsense is the impedance in ohm; vr + j vi of position is in mm per volt",
            "about 0 V; set the dc value of Vdrive for another bias",
        ],
        [
            "Vdrive drive 0 dc 0 ac 1",
            *STRIP,
            TIGHT_OPTIONS,
            ".print ac vr(position) vi(position) ir(Vsense) ii(Vsense)",
            f".ac dec {_A_DECADE} {made.lowest:.6g} {made.highest:.6g}",
        ],
    )


def response(made: Plan) -> str:
    """Return the deck of the drive itself."""
    step, longest = steps(made.duration)
    if made.drive.angular_frequency():
        longest = min(longest, 0.01 / made.drive.angular_frequency())
    return finished(
        f"The strip under its drive: {made.drive.text}",
        ["v(plus) is the voltage, i(vsense) the current into the strip, v(position) the position, 1 V = 1 mm"],
        [
            f"Vdrive drive 0 {made.drive.spice(made.duration)}",
            *STRIP,
            *transient_lines(made.duration, step, longest, "v(plus) i(Vsense) v(position)"),
        ],
    )


#: A strip at node ``drive``, its current through Vsense, its tip free.
STRIP = ("Vsense drive plus 0", f"X1 plus 0 tip position {NAME}", "Vtip tip 0 0")


def steps(duration: float) -> tuple[float, float]:
    """Return how far rows are apart and how long steps are at most [s], for a run of ``duration`` [s]."""
    return duration / (_ROWS - 1), duration * LONGEST_STEP


def finished(title: str, notes: list[str], body: list[str]) -> str:
    """Return a deck: its title, what it says of itself, the library and its ``body``."""
    head = [title, *notes, "run: ngspice -b FILE, in the folder of strip.lib"]
    lines = [*(f"* {plain(line)}" for line in head), ".include strip.lib"]
    lines += [part for line in body for part in ([line] if line.startswith("*") else folded([line]))]
    return "\n".join([*lines, ".end", ""])

"""The page of the demonstration: its pictures, what they mean, and commands that do the next things."""

from __future__ import annotations

import base64
import os
import shlex
import shutil
import sys
from pathlib import Path

from ..browser.assets import FOLDER as BROWSER_FILES
from ..identification.identification import Identification
from ..report.page import Block, Listing, Page, Picture, Prose, Section, picture
from ..simulation.response import Response
from ..strip.elements import lumped_elements
from ..units import format_quantity

#: Name of the page in the demonstration's folder.
PAGE = "index.html"


def demo_page(folder: Path, step: Response, square: Response, fit: Identification) -> Page:
    """Return the page: a ``step`` and a ``square`` wave simulated, the ``fit`` of the step with noise, what is next."""
    end = format_quantity(float(step.displacement[-1]), "m", 3)
    capacitance, known = fit["capacitance"], step.actuator
    low, high = (format_quantity(end, "F", 4) for end in capacitance.interval or (capacitance.value,) * 2)
    sections = [
        Section("The strip", [*_drawing(), Prose(_STRIP)]),
        Section("A step of 4 V", [picture(step.figure(), "current, displacement and charge over time"), Prose(_STEP)]),
        Section("A square wave", [picture(square.figure(), "the same under a square wave"), Prose(_SQUARE)]),
        Section("A fit", [picture(fit.figure(), "measured points, the fit, and residuals below"), Prose(_FIT)]),
        Section("What to do next", [block for pair in next_commands(folder) for block in _shown(*pair)]),
    ]
    facts = [
        (f"tip of {known.name} after 300 s at 4 V", end),
        ("capacitance, fitted", f"{format_quantity(capacitance.value, 'F', 4)} (95 %: {low} to {high})"),
        ("capacitance that made the data", format_quantity(lumped_elements(known).port.branches[0][1], "F", 4)),
    ]
    headline = "A strip of ionic liquid gel: simulated by ngspice, measured with noise, and identified from that"
    return Page("Demonstration of ilg_circuit", headline, facts, fit.warnings, sections)


def next_commands(folder: Path) -> list[tuple[str, str]]:
    """Return what to do next: a sentence, and a command that works as it stands in this folder of work."""
    program = _program()

    def made(name: str) -> str:
        return shlex.quote(str(folder / name))

    pairs = [
        ("Fit a measurement. Put your own CSV file in place of this one.",
         f"identify {made('measured.csv')} --actuator {made('paper.toml')} --out {made('own.toml')} "
         f"--report {made('own.html')} --table {made('own.tex')}"),
        ("Describe a strip of your own.",
         f"new {made('strip.toml')} --length 40mm --free-length 35mm --width 5mm --thickness 0.4mm "
         "--youngs-modulus 8kPa"),
        ("Predict what the fitted strip does under another voltage, as a picture for a column of a paper.",
         f"simulate {made('own.toml')} --drive square:-2V..2V,60s --duration 120s --band "
         f"--plot {made('prediction.pdf')} --size 85mm"),
        ("See how the displacement depends on the thickness.",
         f"sweep {made('own.toml')} --vary thickness=0.3mm:0.6mm:7 --drive step:2V --duration 100s "
         f"--out {made('sweep.csv')}"),
        ("Give the circuit to whoever builds the driver.", f"netlist {made('own.toml')} --out {made('own.lib')}"),
        ("Let a rhythm of neurons move an arm cut from the strip. The first run compiles for half a minute.",
         f"arm --duration 3s --out {made('motion.nc')} --animate {made('motion.gif')}"),
    ]  # fmt: skip
    if (BROWSER_FILES / "ngspice.js").is_file():
        pairs.insert(4, ("Write a page with sliders that solves the strip in any browser.",
                         f"page {made('own.toml')} --out {made('strip.html')}"))  # fmt: skip
    return [(why, f"{program} {command}") for why, command in pairs]


def _program() -> str:
    """Return what a user must type to run this installation from the present folder."""
    here = Path(sys.executable).with_name("ilg-circuit")
    found = shutil.which("ilg-circuit")
    if found and here.exists() and os.path.samefile(found, here):
        return "ilg-circuit"
    if not here.exists():
        return f"{shlex.quote(sys.executable)} -m ilg_circuit"
    inside = here.is_relative_to(Path.cwd())
    return shlex.quote(str(here.relative_to(Path.cwd()) if inside else here))


def _shown(why: str, command: str) -> list[Block]:
    return [Prose(why), Listing(command)]


def _drawing() -> list[Block]:
    """Return the drawing of the strip: from the package's data if installed, from ``docs`` in a checkout."""
    package = Path(__file__).parents[1]
    name = "strip_and_setup.svg"
    for place in (package / "data" / name, package.parent / "docs" / "pictures" / name):
        if place.is_file():
            data = base64.b64encode(place.read_bytes()).decode("ascii")
            about = "strip in its clamp, electrodes, potentiostat and camera; the free end bends to the anode"
            return [Picture(data, about, "image/svg+xml")]
    return []


_STRIP = (
    "A gel that holds an ionic liquid lies between two electrodes. A voltage moves its ions; the large cations gather "
    "at the cathode and swell it, and the free end bends towards the anode. A potentiostat records voltage and "
    "current, a camera or a laser the displacement."
)
_STEP = (
    "Displacement, charge and current after a voltage of 4 V is switched on. The current begins at the voltage over "
    "the strip's smallest resistance and falls as the ions charge the electrodes; what is left at the end flows "
    "through the electron path. The tip overshoots and creeps back: that is the coupling d(s), fitted to the paper's "
    "strip. ngspice solved the circuit; the exact solver and the closed forms agree, as the terminal's lines say."
)
_SQUARE = (
    "The same strip under a square wave of both signs, here with the mass of the strip: the dynamic beam. At each "
    "reversal the tip swings about its path, at the natural frequency of the strip as a cantilever."
)
_FIT = (
    "The step again, as an instrument would record it: with noise and a rest before the step. Points are measured, the "
    "line is the fit. The panels of residuals show what the fit leaves: a cloud without a shape, as noise is. The "
    "capacitance that made the data lies within the interval that the fit states."
)

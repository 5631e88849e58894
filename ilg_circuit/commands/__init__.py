"""The commands of `ilg-circuit`, one a module of its name, imported when it is called.

In: options. Out: files, text and an exit code. May import: every room.
"""

#: Command -> the first sentence of its help: listing them imports none of them.
COMMANDS = {
    "app": "Open a window with sliders: fit, move, sweep, design, export.",
    "arm": "Move a soft arm and write its motion.",
    "bode": "Compute how displacement, current and force follow frequency.",
    "close": "Close the position loop around a strip, in ngspice or exactly.",
    "cpg": "Run a central pattern generator: period, amplitude, phases.",
    "demo": "Run the whole flow once: simulate, measure, identify, export.",
    "design": "Find the strip, within ranges, that meets requirements best.",
    "doctor": "Check the installation: versions, ngspice, one solved step.",
    "examples": "List the example scripts, or copy them with their notebooks.",
    "identify": "Fit a strip to measured steps, waveforms and impedance spectra.",
    "impedance": "Compute the impedance spectrum at a strip's terminals.",
    "learn": "Learn the voltage for a path over repeated trials.",
    "netlist": "Write a strip as a SPICE deck, a subcircuit, or a kit of both.",
    "new": "Write the file of a strip from its sizes.",
    "ogden": "Fit one hyperelastic material to all load tests of a gel.",
    "page": "Write a strip as a page that runs ngspice in any browser.",
    "reproduce": "Remake every table and figure of both papers, and compare.",
    "sense": "Move a strip's tip; compute the voltage or current it makes.",
    "show": "Print a strip's geometry, elements and limits of the model.",
    "simulate": "Simulate a strip's current, displacement, force and charge.",
    "sweep": "Simulate many strips: on a grid, at random, or from a list.",
    "track": "Find the voltage that makes a strip's tip follow a path.",
    "tune": "Tune a position controller that is robust over a strip's fit.",
    "watch": "Fit each file that an instrument writes into a folder.",
}

"""The commands of `ilg-circuit`, one a module of its name, imported when it is called.

In: options. Out: files, text and an exit code. May import: every room.
"""

#: Command -> the first sentence of its help: listing them imports none of them.
COMMANDS = {
    "arm": "Move a soft arm and write its motion.",
    "cpg": "A central pattern generator: whether it oscillates, period, amplitude, phases, outputs over time.",
    "demo": "The whole flow once, with pictures: simulate, check, measure with noise, identify, hand out.",
    "design": "Look for the strip, within ranges, that does what is required: best, or on a Pareto front.",
    "doctor": "Versions, the ngspice library, and a self-check against the closed form.",
    "identify": "Fit a strip to measured steps, waveforms and impedance spectra.",
    "impedance": "The small-signal spectrum at the strip's terminals, by AC analysis about a bias voltage.",
    "netlist": "Write the strip as a SPICE netlist.",
    "new": "Write the file of a strip from its sizes; identify fits the rest.",
    "ogden": "Fit a hyperelastic material to load tests, all of them together.",
    "page": "Write the strip as a page for any browser: sliders, and ngspice in the page.",
    "reproduce": "Remake every table and figure of both papers, and compare.",
    "sense": "Move a strip's tip and write what its terminals show.",
    "show": "Geometry, lumped elements, and where the model holds.",
    "simulate": "Drive a strip and write its current, displacement, force and charge over time.",
    "sweep": "Vary a strip, its drive or its load, and write what each design does: one netCDF file with units.",
    "watch": "Fit what an instrument writes into a folder, each file as it arrives.",
}

"""
Which voltages make a strip follow a shape?
===========================================

A strip whose electrodes are cut into four segments, each with a voltage of its own, can bend into other shapes than an
arc. The voltages nearest to a path of its shape, first for an S that turns over, then for a wave that travels along it.
"""

import numpy as np

import ilg_circuit as ilg

sheets = {"sheet_resistance_1": "0.25 ohm", "sheet_resistance_2": "0.25 ohm", "contact": "each", "cells": 8}
four = ilg.PAPER.with_(electrodes=sheets | {"segments_1": 4, "segments_2": 4})

# sphinx_gallery_alt = "Curvatures of four segments with their path, error, voltages, the strip as an S at five times."
time = np.array([0, 40, 80, 160, 200])
turn = np.array([0, 1, 1, -1, -1])
turned = ilg.track(
    four, {1: (time, 5 * turn), 2: (time, 3 * turn), 3: (time, -4 * turn), 4: (time, -6 * turn)}, nodes=81
)
turned.plot()

# %%
# Each line says what the path asks for beside what the strip can do: the reach of each target at rest within the limits
# of the voltages, its largest rate, the error.

print(turned.summary())

# %%
# A wave of two periods a minute is too fast at 4 V. The warnings say by how much.

fine = np.linspace(0, 120, 121)
wave = {k: (fine, 4 * np.sin(2 * np.pi * (fine / 30 - k / 4)) * np.minimum(fine / 30, 1)) for k in (1, 2, 3, 4)}
fast = ilg.track(four, wave, voltage="4 V", nodes=61)
print(*fast.warnings, sep="\n")
print({name: f"{rms:.2f} 1/m" for name, rms in fast.rms.items()})

# %%
# The voltages are a drive for a simulation, and a file for a source of several channels. The curvatures of the run are
# those that were promised.

turned.write_drive("drive.csv")
again = ilg.simulate(four, "file:drive.csv", "200 s", engine="exact")
for k in (1, 3):
    print(f"segment {k}: {again.segments[f'curvature_{k}'][240]:.3f} 1/m after {again.time[240]:.0f} s")

# %%
# A path of the tip alone leaves open which segments make it. Those near the clamp move the tip most, and the least
# effort uses them most; one voltage for all takes more energy.

for alike in (False, True):
    tip = ilg.track(four, "sine:2mm,5mHz", "200 s", quantity="shape", alike=alike, nodes=81)
    volts = ", ".join(f"{np.abs(wave).max():.2f} V" for wave in tip.voltages.values())
    print(f"{'alike' if alike else 'least effort'}: up to {volts}; {tip.energy:.2f} J")

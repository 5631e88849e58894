"""
A strip cut into segments
=========================

Gold or carbon sheets have a resistance along the strip. Cut into segments, each with a source of its own, they bend
the strip into other shapes than an arc. A strip with ``[electrodes]`` is a line of cells: two sheets, and the circuit
of the strip in each cell.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

carbon = {"sheet_resistance_1": "5 ohm", "sheet_resistance_2": "5 ohm"}
whole = ilg.PAPER.with_(electrodes=carbon)
run = ilg.simulate(whole, "step:4V", "60 s", engine="exact")
print(run)

# %%
# The voltage falls along the sheets, so that the base bends first. Where the ions have come to rest only the electrons'
# current is left, and the curvature is nearly uniform.

# sphinx_gallery_alt = "Curvature along the strip at 1, 5, 20, 60 s: it falls towards the tip at first, then evens out."
bent = run.curvatures
places = 1e3 * (np.cumsum(bent.lengths) - bent.lengths / 2)
figure, axes = plt.subplots()
for seconds in (1, 5, 20, 60):
    at = np.searchsorted(bent.time, seconds)
    axes.plot(places, bent.values[at] / bent.values[at, 0], label=f"{seconds} s")
axes.set_xlabel("place on the strip [mm]")
axes.set_ylabel("curvature over that at the clamp")
axes.set_ylim(0, 1.05)
axes.legend()

# %%
# Four segments on each side, the fourth one open. Segments that no drive names are at 0 V.

# sphinx_gallery_alt = "Curvature over time and place: segment 1 bends one way, 2 in turns, 3 the other way."
four = ilg.PAPER.with_(electrodes=carbon | {"segments_1": 4, "segments_2": 4, "gap": "0.5 mm", "contact": "each"})
drives = {1: "step:4V", 2: "square:-4V..4V,20s", 3: "step:-4V", 4: "open"}
run = ilg.simulate(four, drives, "60 s", engine="exact")
run.plot("curvature")

# %%
# Each segment has its own current. Their sources deliver what the sheets and cells dissipate and store.

# sphinx_gallery_alt = "Currents of the first three segments over time: the second one jumps each 10 s."
figure, axes = plt.subplots()
for segment in (1, 2, 3):
    axes.plot(run.time, 1e3 * run.segments[f"current_{segment}"], label=f"segment {segment}")
axes.set_xlabel("time [s]")
axes.set_ylabel("current [mA]")
axes.legend()
print(run.account)

# %%
# One source for all, in a spectrum: below about one the line number says that a spectrum cannot tell the sheets from a
# resistor in front of the strip.

spectrum = ilg.impedance(whole, "1 mHz", "10 Hz", engine="exact")
print(spectrum)
for name in ("line_resistance", "line_number_low", "line_number_high"):
    print(name, whole.describe("1 mHz", "10 Hz")["elements"][name])

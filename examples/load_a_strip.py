"""
A strip, and a changed copy
===========================

A strip is a preset or a TOML file: its geometry, its gel, and the coupling from voltage to motion. ``paper`` is the
strip of the paper. ``with_`` returns a changed copy; names are those of the file, values carry their units.
"""

import matplotlib.pyplot as plt

import ilg_circuit as ilg

strip = ilg.load("paper")
print(strip)

# %%
# The static displacement at a given voltage is in inverse proportion to the square of the thickness.
thinner = strip.with_(thickness="0.4 mm", name="thinner")
print(f"{strip.geometry.thickness:g} m, {thinner.geometry.thickness:g} m")

# sphinx_gallery_alt = "Displacement over time of two strips under 4 V: the thinner one, dashed, bends farther."
figure, axes = plt.subplots()
for one, line in ((strip, "-"), (thinner, "--")):
    run = ilg.simulate(one, "step:4V", "120 s", engine="exact", beam="static")
    run.plot(axes, "displacement", label=one.name, linestyle=line)
axes.legend()

"""
Which way the strip is held
===========================

A soft strip feels its weight. The ratio of weight to stiffness says how much. Where it is large, this model
does not hold, and every command says so.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

for orientation in ("weightless", "hanging", "horizontal"):
    run = ilg.simulate(ilg.PAPER.with_(orientation=orientation), "step:4V", "60 s", engine="exact")
    print(f"{orientation:10} {1e3 * run.displacement[-1]:6.2f} mm", *run.warnings, sep="\n    ")

# %%
# How stiff must this strip be so that its weight does not matter?

# sphinx_gallery_alt = "Displacement over Young's modulus: constant without weight; hanging it gets there at some MPa."
figure, axes = plt.subplots()
moduli = np.geomspace(7.6e3, 1e7, 25)
for orientation, line in (("weightless", "-"), ("hanging", "--")):
    strips = [ilg.PAPER.with_(orientation=orientation, youngs_modulus=e) for e in moduli]
    runs = [ilg.simulate(one, "step:4V", times=[0.0, 60.0], engine="exact", beam="static") for one in strips]
    axes.semilogx(moduli / 1e3, [1e3 * run.displacement[-1] for run in runs], line, label=orientation)
axes.set_xlabel("Young's modulus [kPa]")
axes.set_ylabel("displacement after 60 s [mm]")
axes.legend()

"""
Can a controller follow a strip that dries?
===========================================

A strip that bends with its charge loses half of its capacitance within the run, and its resistance triples. A fixed PI
controller falls behind. An adaptive one identifies the strip while it runs, and changes its gains.
"""

import numpy as np

import ilg_circuit as ilg

strip = ilg.load("paper").with_(kind="charge", instantaneous="130 nm/V")
tuned = ilg.tune(strip, "2 mm", gains="gain=4V/mm,reset_time=8s", beam="static")
drying = {"drift": "capacitance=-50%,dynamic_resistance=+200%", "period": "0.5 s", "noise": "5 um", "beam": "static"}

fixed = ilg.close_loop(strip, tuned, "sine:1.5mm,10mHz", "1000 s", samples=2001, **drying)
adaptive = ilg.close_loop(strip, tuned, "sine:1.5mm,10mHz", "1000 s", samples=2001, adapt=True, **drying)
for run in (fixed, adaptive):
    error = run.reference - run.displacement
    first, last = (1e6 * np.std(part) for part in (error[:200], error[-200:]))
    print(f"{run.controller}: error {first:.0f} um in the first 100 s, {last:.0f} um in the last")

# %%

# sphinx_gallery_alt = "The error of the adaptive loop stays as it is; what it found of the strip follows the truth."
axes = adaptive.plot()

# %%
# The same controller as an object, for a program of your own: it is called with what was measured.

controller = ilg.adaptive(strip, tuned, "0.5 s", beam="static")
print(f"{controller.step(1e-3, 0.0):.2f} V", controller.gains)

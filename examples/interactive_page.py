"""
The strip as a page for any browser
===================================

One HTML file with sliders, in which ngspice solves the strip without a network. It needs the files that ``make
setup`` fetches by npm; a wheel has them.
"""

import ilg_circuit as ilg

try:
    path = ilg.page("paper", "strip.html", "square:4V,30s", "120 s")
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, opens from disk")
except ilg.IlgError as error:
    print(error)

# %%
# What the page draws at first is what the package computes, within what the page states.

# sphinx_gallery_alt = "Voltage, current, charge, displacement and force of the page's first run, a square wave of 4 V."
axes = ilg.simulate("paper", "square:4V,30s", "120 s").plot()

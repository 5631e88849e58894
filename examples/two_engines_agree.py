"""
Two engines agree
=================

ngspice solves the PySpice circuit; the exact engine solves the same element list by matrix exponentials. Neither
knows of the other. ngspice states how far it may be off, and the difference shows whether that is true.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

solved = ilg.simulate("paper", "square:-2V..2V,30s", "120 s")
exact = ilg.simulate("paper", "square:-2V..2V,30s", times=solved.time, engine="exact")

# %%

# sphinx_gallery_alt = "The relative differences of current and displacement between both engines, below 1e-9."
figure, axes = plt.subplots()
for name, line in (("current", "-"), ("displacement", "--")):
    difference = abs(getattr(solved, name) - getattr(exact, name)) / abs(getattr(exact, name)).max()
    axes.semilogy(solved.time, np.maximum(difference, 1e-17), line, label=name)
    print(f"{name:13} differs by {difference.max():.1e}; ngspice states at most {solved.error:.1e}")
axes.set_xlabel("time [s]")
axes.set_ylabel("difference / maximum")
axes.legend()

# %%
# ``check=True`` does this for any strip, and adds the papers' closed forms.
checked = ilg.simulate("paper", "step:4V", "100 s", beam="static", check=True)
for one in checked.checks:
    print(f"{one.quantity:13} {one.reference:13} {one.value:.1e}")

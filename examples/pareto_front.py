"""
Displacement against force
==========================

Of the designs on a Pareto front none is better than another in both. Every point is the end of an optimisation of
its own.
"""

import ilg_circuit as ilg

ranges = {"thickness": ("0.2 mm", "1 mm"), "free_length": ("15 mm", "40 mm")}
front = ilg.pareto("paper", "step:4V", "300 s", ranges, ["displacement_final", "force_blocked"], points=4)
print(front.summary())

# %%

# sphinx_gallery_alt = "The front: blocked force falls as the final displacement rises, from designs marked by circles."
axes = front.plot()

"""
Outliers are named and left out
===============================

A single reading that stands apart from its neighbours and from any model is named and left out. The fit is that of
the other readings.
"""

import numpy as np

import ilg_circuit as ilg

time = np.arange(-5.0, 60.0, 0.2)
after = np.maximum(time, 0.0)
current = np.where(time < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-after / 7))
current += np.random.default_rng(2).normal(0, 5e-4, time.size)
current[[120, 230]] += [0.05, -0.03]

fit = ilg.identify(
    time=time, voltage=np.where(time < 0, 0.0, 4.0), current=current, strip="paper", model="rc", onset="0 s"
)
print(*fit.warnings, sep="\n")

# %%

# sphinx_gallery_alt = "Measured current with two spikes, the fit that ignores them, and the residuals."
axes = fit.plot()

"""
Parameters with standard errors and intervals
=============================================

The step begins somewhere between two readings. That widens the intervals of whatever depends on it; ``onset``
states it where it is known.
"""

import matplotlib.pyplot as plt
import numpy as np

import ilg_circuit as ilg

time = np.arange(-5.0, 60.0, 0.2)
after = np.maximum(time, 0.0)
current = np.where(time < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-after / 7))
current += np.random.default_rng(2).normal(0, 5e-4, len(time))
step = {"time": time, "voltage": np.where(time < 0, 0.0, 4.0), "current": current}
names = ("dc_resistance", "dynamic_resistance", "capacitance")

# %%
# The open circles are the values that made the data.

# sphinx_gallery_alt = "Three intervals, relative to the truth, onset open or stated: stated, two are narrower."
figure, axes = plt.subplots()
for shift, onset in enumerate((None, "0 s")):
    fit = ilg.identify(**step, strip="paper", model="rc", onset=onset)
    for place, (name, truth) in enumerate(zip(names, (600, 20, 7 / 20), strict=True)):
        found = fit[name]
        low, high = found.interval
        print(f"{name:20} {found.value:8.4g} +- {found.stderr:.2g} {found.unit}, 95 %: {low:.4g} to {high:.4g}")
        axes.plot([low / truth, high / truth], [place + 0.2 * shift] * 2, ("C0-", "C1--")[shift], linewidth=3)
    print(f"onset {'left open' if onset is None else 'stated'}\n")
axes.plot([1, 1, 1], [0.1, 1.1, 2.1], "o", color="black", fillstyle="none")
axes.set_yticks([0.1, 1.1, 2.1], names)
axes.set_xlabel("interval / truth (dashed: onset stated)")
figure.tight_layout()
